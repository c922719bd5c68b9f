// A game's loop that drives ARKit weights while sound is still coming: one thread pushes it, another pulls frames.
#include <mouthpiece/speaker.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <thread>

int main(int argc, char** argv) {
  using namespace std::chrono;
  try {
    mouthpiece::SpeakerOptions options;
    options.with_face = false;  // the engine draws its own
    options.voice = "flite:slt";
    mouthpiece::Speaker speaker(options);
    // In place of a microphone.
    const mouthpiece::Sound sound = speaker.perform(argc > 1 ? argv[1] : "the time is now").sound();
    mouthpiece::LiveStream stream = speaker.live({.look_ahead = 0.2, .sample_rate_hz = sound.sample_rate_hz});

    std::thread microphone([&] {
      const auto begun = steady_clock::now();
      const std::size_t chunk = static_cast<std::size_t>(sound.sample_rate_hz) / 50;  // 20 ms
      for (std::size_t at = 0; at < sound.samples.size(); at += chunk) {
        std::this_thread::sleep_until(begun + milliseconds(20) * static_cast<int>(at / chunk + 1));
        const std::size_t count = std::min(chunk, sound.samples.size() - at);
        stream.push(std::span(sound.samples).subspan(at, count), at);
      }
      stream.finish();
    });

    std::size_t drawn = 0;
    float widest_jaw = 0;
    const auto begun = steady_clock::now();
    while (!stream.isFinished()) {
      const mouthpiece::Frame* frame = drawn == 0 ? stream.next() : stream.nextNow();
      if (frame != nullptr) {
        ++drawn;
        for (std::size_t shape = 0; shape < frame->arkit.size(); ++shape) {
          if (mouthpiece::arkitName(shape) == "JawOpen") widest_jaw = std::max(widest_jaw, frame->arkit[shape]);
        }
      }
      std::this_thread::sleep_for(microseconds(16'667));
    }
    microphone.join();
    const mouthpiece::LiveCounts counts = stream.counts();
    std::cout << drawn << " frames in " << duration<double>(steady_clock::now() - begun).count() << " s, "
              << counts.frames_at_rest << " at rest, " << counts.dropped << " chunks lost, the jaw opened to "
              << widest_jaw << '\n';
  } catch (const mouthpiece::InputError& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
