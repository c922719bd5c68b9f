// synth serve: the page live, for those who use no shell.
#include <fmt/format.h>

#include "base/errors.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "local_server/local_server.h"
#include "programs/synth/commands.h"
#include "programs/synth/served_lines.h"
#include "speaker/shared_files.h"

namespace mouthpiece {
namespace {

/// A recording of an hour and a half in stereo at 48 kHz, or a head with its textures.
constexpr std::size_t kMostUploadBytes = std::size_t{1} << 30;

struct ServeOptions : SharedOptions {
  std::filesystem::path folder = "mouthpiece-out";
  int port = 0;
};

void addOptions(CLI::App& app, ServeOptions& options) {
  app.add_option("--out", options.folder, "Folder for the lines; those that are in it are shown again")
      ->capture_default_str();
  app.add_option("--port", options.port, "Port of 127.0.0.1; 0: any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  addSharedOptions(app, options);
}

std::size_t numberOf(const LocalRequest& request, const std::string& name) {
  const std::string text = request.parameter(name);
  if (text.empty() || text.size() > 6 || text.find_first_not_of("0123456789") != std::string::npos)
    throw InputError(fmt::format("found {} for {}; expected a number", printable(text), name));
  return std::stoul(text);
}

/// The body of a request that asks for a line.
LineWish wishOf(const LocalRequest& request) {
  const JsonField fields = parseJson(request.body, "the request", "a line");
  LineWish wish;
  const auto text = [&](const char* name, std::size_t most) {
    const JsonField field = fields[name];
    return field.exists() ? field.text(most) : std::string();
  };
  wish.text = text("text", 1 << 20);
  wish.recording = std::filesystem::path(text("recording", 256)).filename().string();
  wish.voice = text("voice", 256);
  wish.face = text("face", 256);
  wish.language = text("language", 64);
  wish.edits = text("edits", 1 << 24);
  wish.expression = expressionIn(fields);
  return wish;
}

LocalReply replyOf(std::size_t line) {
  return {200, "application/json", fmt::format("{{\"line\":{}}}\n", line), {}, {}};
}

/// Pages of ours bring their own policy; only ours may frame them.
LocalReply pageReply(std::string html) {
  return {200, "text/html; charset=utf-8", std::move(html), "frame-ancestors 'self'", {}};
}

std::string typeOf(const std::string& name) {
  if (name.ends_with(".json")) return "application/json";
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  return name.ends_with(".wav") ? "audio/wav" : "application/octet-stream";
}

void addRoutes(LocalServer& server, ServedLines& lines, const std::string& page) {
  server.get("/", [page](const LocalRequest&) {
    LocalReply reply = pageReply(page);
    reply.policy = "frame-ancestors 'none'";
    return reply;
  });
  server.get("/state", [&lines](const LocalRequest&) {
    LocalReply reply;
    reply.body = lines.state();
    return reply;
  });
  server.get("/page", [&lines](const LocalRequest& request) {
    return pageReply(readFile(lines.file(numberOf(request, "line"), "view.html")));
  });
  server.get("/source", [&lines](const LocalRequest& request) {
    return pageReply(lines.sourcePage(numberOf(request, "line"), numberOf(request, "unit")));
  });
  server.get("/file", [&lines](const LocalRequest& request) {
    const std::string name = request.parameter("name");
    LocalReply reply;
    reply.body = readFile(lines.file(numberOf(request, "line"), name));
    reply.type = typeOf(name);
    reply.file_name = name;
    return reply;
  });
  server.post("/line", [&lines](const LocalRequest& request) { return replyOf(lines.add(wishOf(request))); });
  server.post("/change", [&lines](const LocalRequest& request) {
    return replyOf(lines.change(numberOf(request, "line"), wishOf(request)));
  });
  server.post("/cancel", [&lines](const LocalRequest& request) {
    lines.cancel(numberOf(request, "line"));
    return LocalReply{};
  });
  const auto kept = [](const std::string& name) {
    LocalReply reply;
    reply.body = "{\"name\":\"" + name + "\"}\n";  // of plain letters
    return reply;
  };
  server.post("/recording", [&lines, kept](const LocalRequest& request) {
    return kept(lines.keepRecording(request.parameter("name"), request.body));
  });
  server.post("/head", [&lines, kept](const LocalRequest& request) {
    return kept(lines.keepHead(request.parameter("name"), request.body));
  });
}

int runServe(const ServeOptions& options) {
  const std::string page = readFile(findSharedFile("serve.html", "make it with `make build` in the checkout"));
  ServedLines lines(speakerOf(options), options.folder);
  LocalServerOptions wanted;
  wanted.port = options.port;
  wanted.max_body_bytes = kMostUploadBytes;
  LocalServer server(wanted);
  addRoutes(server, lines, page);
  printText(fmt::format("Open this address in your browser; end with Ctrl-C:\n  {}\n", server.address()));
  if (std::fflush(stdout) != 0) throw InputError("stdout", "", "cannot be written");
  server.serve();
  return kExitDone;
}

}  // namespace

Command serveCommand() {
  return makeCommand<ServeOptions>(
      "serve", "Opens a page on this machine: type lines, drop recordings and heads on it, see them and change them",
      "synth serve\nsynth serve --out my-lines --voice flite:slt", addOptions, runServe);
}

}  // namespace mouthpiece
