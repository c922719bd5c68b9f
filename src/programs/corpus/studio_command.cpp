// corpus studio: one's own corpus, from a webcam.
#include <fmt/format.h>
#include <sys/stat.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "hearing/alignment/pronouncer.h"
#include "local_server/local_server.h"
#include "mouthpiece/face.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/corpus/prompt_sentences.h"
#include "programs/corpus/studio_session.h"
#include "speaker/shared_files.h"

namespace mouthpiece {

extern const std::string_view kRichSentences, kEnglishPairs;

namespace {

/// A minute of a take at a camera's best, and an image of it.
constexpr std::size_t kMostUploadBytes = std::size_t{1} << 28;
/// The first sentence brings the lips together again and again: in it the closed lips are measured.
constexpr const char* kLipSentence = "Maybe Bob and Pam must pay my mother back for the map.";

struct StudioArguments {
  bool quiet = false;
  std::size_t count = 25;
  std::filesystem::path folder, text, grammar, lexicon, face;
  int port = 0;
  bool keep_video = false;
  std::string language = "en";
};

/// Few sentences with as much as possible of what running English holds; or those of the user's file.
std::vector<Prompt> studioPrompts(const StudioArguments& given, const StudioOptions& options) {
  const Pronouncer pronouncer(&options.lexicon, *options.language);
  const bool is_english = options.language == &english();
  const bool is_own = !given.text.empty() || !given.grammar.empty();
  if (!is_english && !is_own) {
    throw InputError(
        "--language", "",
        fmt::format("{} has no sentences here; expected some by --text or --grammar", options.language->name));
  }
  std::vector<Prompt> prompts;
  for (const std::string& sentence :
       is_own ? sentencesOf(given.text.empty() ? given.grammar : given.text, given.text.empty())
              : sentenceLines(kRichSentences))
    prompts.push_back(promptOf(sentence, pronouncer));
  const PairShares shares = parsePairShares(kEnglishPairs, "english_pairs.csv");
  std::vector<Prompt> chosen;
  if (!is_own) chosen.push_back(promptOf(kLipSentence, pronouncer));
  for (const std::size_t i :
       choosePrompts(prompts, given.count - chosen.size(), is_english ? &shares : nullptr).sentences)
    chosen.push_back(prompts[i]);
  return chosen;
}

std::size_t numberIn(const LocalRequest& request, const std::string& name) {
  const std::string text = request.parameter(name);
  if (text.empty() || text.size() > 6 || text.find_first_not_of("0123456789") != std::string::npos)
    throw InputError(fmt::format("found {} for {}; expected a number", printable(text), name));
  return std::stoul(text);
}

LocalReply lookReply(const StudioLook& look) {
  nlohmann::json points = nlohmann::json::array();
  for (const Eigen::Vector2d& point : look.points) points.push_back({point.x(), point.y()});
  LocalReply reply;
  reply.body = nlohmann::json{{"face", look.has_face}, {"points", points}, {"advice", look.advice}}.dump();
  return reply;
}

void addStudioRoutes(LocalServer& server, StudioSession& session, const std::string& page) {
  // Pages of ours bring their own policy.
  const auto pageOf = [](std::string html, const char* policy) {
    return LocalReply{200, "text/html; charset=utf-8", std::move(html), policy, {}};
  };
  server.get("/", [=](const LocalRequest&) { return pageOf(page, "frame-ancestors 'none'"); });
  server.get("/line",
             [=, &session](const LocalRequest&) { return pageOf(session.linePage(), "frame-ancestors 'self'"); });
  server.get("/state", [&session](const LocalRequest&) {
    LocalReply reply;
    reply.body = session.state();
    return reply;
  });
  server.post("/look", [&session](const LocalRequest& request) {
    return lookReply(session.look(numberIn(request, "width"), numberIn(request, "height"), request.body));
  });
  const auto post = [&server](const char* path, std::function<void(const LocalRequest&)> work) {
    server.post(path, [work = std::move(work)](const LocalRequest& request) {
      work(request);
      return LocalReply{};
    });
  };
  post("/take",
       [&session](const LocalRequest& request) { session.keepTake(numberIn(request, "prompt"), request.body); });
  post("/forget", [&session](const LocalRequest& request) { session.forgetTake(numberIn(request, "prompt")); });
  post("/forget-all", [&session](const LocalRequest&) { session.forgetAll(); });
  post("/wear", [&session](const LocalRequest& request) { session.wearHead(request.parameter("head")); });
  post("/head", [&session](const LocalRequest& request) { session.keepHead(request.parameter("name"), request.body); });
  post("/make", [&session](const LocalRequest& request) {
    session.make(std::string(request.body), request.parameter("voice"));
  });
}

int runStudio(const StudioArguments& given) {
  ::umask(077);  // nobody else reads what is recorded here
  const std::string page = readFile(findSharedFile("studio.html", "make it with `make build` in the checkout"));
  StudioOptions options;
  options.folder = given.folder;
  options.language = &languageOf(given.language);
  options.lexicon = lexiconFrom(given.lexicon, *options.language);
  options.prompts = studioPrompts(given, options);
  options.models =
      findSharedFile("face_tracker/face_landmarks.tflite", "make it with `make build` in the checkout").parent_path();
  options.face = given.face;
  options.keep_video = given.keep_video;
  static_cast<void>(SharedFace(given.face));  // throws for what is no face
  StudioSession session(std::move(options));
  LocalServerOptions wanted;
  wanted.port = given.port;
  wanted.max_body_bytes = kMostUploadBytes;
  LocalServer server(wanted);
  addStudioRoutes(server, session, page);
  printText(fmt::format("Open this address in your browser; end with Ctrl-C:\n  {}\n", server.address()));
  if (std::fflush(stdout) != 0) throw InputError("stdout", "", "cannot be written");
  server.serve();
  return kExitDone;
}

void addOptions(CLI::App& command, StudioArguments& options) {
  command.add_option("folder", options.folder, "Where the takes, the corpus and the lines are kept")->required();
  command.add_option("--count", options.count, "How many sentences")->capture_default_str()->check(CLI::Range(2, 2000));
  auto* grammar = command.add_option("--grammar", options.grammar, "Sentences of a grammar file");
  command.add_option("--text", options.text, "Sentences of a file, one a line")->excludes(grammar);
  command.add_option("--face", options.face,
                     "Head that speaks the line, made by `retarget fit` (default: the sample face)");
  command.add_option("--port", options.port, "Port of 127.0.0.1; 0: any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command.add_flag("--keep-video", options.keep_video, "Keep the camera's recordings, too");
  addLexiconOption(command, options.lexicon);
  addLanguageOption(command, options.language);
}

}  // namespace

Command studioCommand() {
  return makeCommand("studio", "Opens a page on this machine: record your own face with a webcam, and let it speak",
                     "corpus studio me\ncorpus studio me --count 50 --face my_head.face", addOptions, runStudio);
}

}  // namespace mouthpiece
