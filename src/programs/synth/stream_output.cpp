#include "programs/synth/stream_ends.h"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include "base/text_numbers.h"
#include "mouthpiece/errors.h"
#include "mouthpiece/performance.h"
#include "programs/program.h"

namespace mouthpiece {
namespace {

class JsonLines : public StreamOutput {
 public:
  void write(const Frame& frame) override {
    line_.clear();
    fmt::format_to(std::back_inserter(line_), "{{\"frame\":{},\"time_s\":{:.4f},\"arkit\":{{", frame.index, frame.time);
    const char* between = "";
    for (std::size_t shape = 0; shape < frame.arkit.size(); ++shape) {
      if (!(frame.arkit[shape] > 0)) continue;
      fmt::format_to(std::back_inserter(line_), "{}\"{}\":{:.4f}", between, arkitName(shape), frame.arkit[shape]);
      between = ",";
    }
    line_ += "}}\n";
    printText(line_);
  }

 private:
  std::string line_;
};

class FloatRows : public StreamOutput {
 public:
  explicit FloatRows(StreamRows what) : what_(what) {}

  void write(const Frame& frame) override {
    if (what_ == StreamRows::kArkit) {
      put(frame.time, frame.arkit);
    } else if (what_ == StreamRows::kMarkers) {
      put(frame.time, frame.markers_mm);
    } else {
      put(frame.time, frame.vertices);
    }
    printText(bytes_);
  }

 private:
  template <typename Values>
  void put(Seconds time, const Values& values) {
    bytes_.resize(sizeof(float) * (1 + values.size()));
    char* to = putOne(static_cast<float>(time), bytes_.data());
    for (const auto value : values) to = putOne(static_cast<float>(value), to);
  }
  static char* putOne(float value, char* to) {
    auto bits = std::bit_cast<std::uint32_t>(value);
    if constexpr (std::endian::native == std::endian::big) bits = __builtin_bswap32(bits);
    std::memcpy(to, &bits, sizeof bits);
    return to + sizeof bits;
  }

  StreamRows what_;
  std::string bytes_;
};

class LiveLinkPackets : public StreamOutput {
 public:
  LiveLinkPackets(const std::string& address, double frame_rate_hz, std::string subject)
      : rate_hz_(frame_rate_hz), subject_(std::move(subject)) {
    const std::size_t colon = address.rfind(':');
    const std::string host = address.substr(0, colon);
    const std::optional<double> port =
        colon == std::string::npos ? std::nullopt : parseNumber(address.substr(colon + 1));
    if (host.empty() || !port || !(*port >= 1 && *port <= 65535) || std::trunc(*port) != *port)
      throw InputError("--to", "", "found '" + address + "'; expected HOST:PORT, as 127.0.0.1:11111");
    addrinfo wanted{};
    wanted.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    const std::string service = std::to_string(static_cast<int>(*port));
    if (getaddrinfo(host.c_str(), service.c_str(), &wanted, &found) != 0 || found == nullptr)
      throw InputError("--to", "", "found the host '" + host + "', which nobody knows; expected HOST:PORT");
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> keeper(found, freeaddrinfo);
    socket_ = socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket_ < 0 || connect(socket_, found->ai_addr, found->ai_addrlen) != 0) {
      if (socket_ >= 0) close(socket_);
      throw InputError("--to", "", "cannot send to " + address + ": " + std::strerror(errno));
    }
  }
  ~LiveLinkPackets() override { close(socket_); }
  LiveLinkPackets(const LiveLinkPackets&) = delete;
  LiveLinkPackets& operator=(const LiveLinkPackets&) = delete;

  void write(const Frame& frame) override {
    const std::string packet = liveLinkPacket(frame, rate_hz_, subject_);
    // Nobody need listen: what cannot be delivered is lost, as a datagram may be.
    (void)!send(socket_, packet.data(), packet.size(), MSG_NOSIGNAL);
  }

 private:
  int socket_ = -1;
  double rate_hz_;
  std::string subject_;
};

}  // namespace

std::unique_ptr<StreamOutput> jsonLines() { return std::make_unique<JsonLines>(); }
std::unique_ptr<StreamOutput> floatRows(StreamRows what) { return std::make_unique<FloatRows>(what); }
std::unique_ptr<StreamOutput> liveLinkPackets(const std::string& address, double frame_rate_hz,
                                              const std::string& subject) {
  return std::make_unique<LiveLinkPackets>(address, frame_rate_hz, subject);
}

struct GrowingWav::State {
  std::string path;
  std::fstream file;
  int rate_hz = 0;
  std::uint64_t samples = 0;

  void put(std::string_view bytes) {
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!file) throw InputError(path, "", "cannot be written");
  }
  /// Sizes over 4 GB do not fit and stay at the most.
  void putHeader() {
    const auto number = [](std::uint64_t value, int bytes) {
      std::string text;
      for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(value >> (8 * i) & 0xFFU));
      return text;
    };
    constexpr std::uint64_t kMost = 0xFFFFFFFFU;
    const auto rate = static_cast<std::uint64_t>(rate_hz);
    file.seekp(0);
    put("RIFF" + number(std::min(kMost, 36 + 2 * samples), 4) + "WAVEfmt " + number(16, 4) + number(1, 2) +
        number(1, 2) + number(rate, 4) + number(2 * rate, 4) + number(2, 2) + number(16, 2) + "data" +
        number(std::min(kMost, 2 * samples), 4));
    file.seekp(0, std::ios::end);
  }
};

GrowingWav::GrowingWav(const std::string& path) : state_(std::make_unique<State>()) {
  state_->path = path;
  if (!std::ofstream(path, std::ios::binary | std::ios::app)) throw InputError(path, "", "cannot be written");
}
GrowingWav::~GrowingWav() = default;

void GrowingWav::write(const Sound& sound, Seconds begin) {
  State& state = *state_;
  if (state.rate_hz == 0) {  // not before there is something to write: what was there is not lost for nothing
    state.file.open(state.path, std::ios::binary | std::ios::in | std::ios::out | std::ios::trunc);
    if (!state.file) throw InputError(state.path, "", "cannot be written");
    state.rate_hz = sound.sample_rate_hz;
    state.putHeader();
  }
  const auto first = static_cast<std::uint64_t>(std::llround(begin * state.rate_hz));
  std::string bytes(first > state.samples ? 2 * (first - state.samples) : 0, '\0');
  for (const float sample : sound.samples) {
    const auto value = static_cast<std::int16_t>(std::lround(32767 * std::clamp(sample, -1.0F, 1.0F)));
    const auto bits = static_cast<std::uint16_t>(value);
    bytes.push_back(static_cast<char>(bits & 0xFFU));
    bytes.push_back(static_cast<char>(bits >> 8U));
  }
  state.put(bytes);
  state.samples += bytes.size() / 2;
  state.putHeader();
  state.file.flush();
}

}  // namespace mouthpiece
