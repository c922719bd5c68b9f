// A game's loop that drives the 52 ARKit weights of a character while a line plays. The clock is the sound's.
#include <mouthpiece/speaker.h>

#include <array>
#include <iomanip>
#include <iostream>

namespace {

/// What an engine would have: a mesh with ARKit's shapes.
struct Character {
  std::array<float, mouthpiece::kArkitShapes> weights{};
  float widest_jaw = 0;

  void pose(const std::array<float, mouthpiece::kArkitShapes>& to) {
    weights = to;
    for (std::size_t shape = 0; shape < to.size(); ++shape) {
      if (mouthpiece::arkitName(shape) == "JawOpen") widest_jaw = std::max(widest_jaw, to[shape]);
    }
  }
};

}  // namespace

int main(int argc, char** argv) {
  try {
    mouthpiece::SpeakerOptions options;
    options.with_face = false;  // the engine draws its own
    mouthpiece::Speaker speaker(options);
    const mouthpiece::Performance line = speaker.perform(argc > 1 ? argv[1] : "the time is now");
    Character character;
    const double step = 1.0 / 90;  // the engine's frames are not the line's
    std::size_t drawn = 0;
    for (double played = 0; played < line.duration(); played += step, ++drawn)
      character.pose(line.arkitWeights(static_cast<std::size_t>(played * line.frameRateHz())));
    character.pose({});
    std::cout << drawn << " frames drawn in " << std::fixed << std::setprecision(2) << line.duration()
              << " s, the jaw opened to " << character.widest_jaw << '\n';
  } catch (const mouthpiece::InputError& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
