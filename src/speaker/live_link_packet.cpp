#include <bit>
#include <cmath>
#include <cstdint>

#include "mouthpiece/live.h"

namespace mouthpiece {
namespace {

constexpr std::uint32_t kPacketVersion = 6;
constexpr std::uint8_t kPacketValues = 61;  // ARKit's shapes, then yaw, pitch and roll of the head and of both eyes
/// The app gives each telephone its own.
constexpr std::string_view kDevice = "$6d6f7574-6870-6965-6365-000000000001";
constexpr std::size_t kMostSubjectBytes = 64;

void putBigEndian(std::string& bytes, std::uint32_t value) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes.push_back(static_cast<char>(value >> shift & 0xFFU));
}

}  // namespace

std::string liveLinkPacket(const Frame& frame, double frame_rate_hz, std::string_view subject) {
  subject = subject.substr(0, kMostSubjectBytes);
  std::string packet;
  packet.reserve(4 + kDevice.size() + 4 + subject.size() + 17 + 4 * kPacketValues);
  for (const unsigned shift : {0U, 8U, 16U, 24U}) packet.push_back(static_cast<char>(kPacketVersion >> shift & 0xFFU));
  packet.append(kDevice);
  putBigEndian(packet, static_cast<std::uint32_t>(subject.size()));
  packet.append(subject);
  putBigEndian(packet, static_cast<std::uint32_t>(frame.index));
  putBigEndian(packet, std::bit_cast<std::uint32_t>(0.0F));  // part of a frame
  putBigEndian(packet, static_cast<std::uint32_t>(std::lround(frame_rate_hz)));
  putBigEndian(packet, 1);
  packet.push_back(static_cast<char>(kPacketValues));
  for (const float weight : frame.arkit) putBigEndian(packet, std::bit_cast<std::uint32_t>(weight));
  for (std::size_t i = frame.arkit.size(); i < kPacketValues; ++i)
    putBigEndian(packet, std::bit_cast<std::uint32_t>(0.0F));
  return packet;
}

}  // namespace mouthpiece
