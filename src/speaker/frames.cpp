#include "mouthpiece/frames.h"

#include "base/index.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {

struct FrameStream::State {
  Performance performance;
  std::size_t following = 0;
  VertexPositions vertices;
  Frame frame;
};

FrameStream::FrameStream(const Performance& performance)
    : state_(std::make_unique<State>(State{performance, 0, {}, {}})) {}
FrameStream::FrameStream(FrameStream&&) noexcept = default;
FrameStream& FrameStream::operator=(FrameStream&&) noexcept = default;
FrameStream::~FrameStream() = default;
const Performance& FrameStream::performance() const { return state_->performance; }

const Frame* FrameStream::next() {
  const Performance& line = state_->performance;
  if (state_->following == line.frameCount()) return nullptr;
  Frame& frame = state_->frame;
  frame.index = state_->following++;
  frame.time = asReal(frame.index) / line.frameRateHz();
  frame.markers_mm = line.motion().frame(frame.index);
  frame.arkit = line.arkitWeights(frame.index);
  if (line.hasFace()) {
    state_->vertices = line.data().verticesAt(FrameIndex(frame.index));
    frame.vertices = {state_->vertices.data(), unsignedIndex(state_->vertices.size())};
  }
  return &frame;
}

}  // namespace mouthpiece
