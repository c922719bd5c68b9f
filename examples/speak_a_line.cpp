// Speaks a line and writes the moving face: speak_a_line "the time is now" talk.glb
#include <mouthpiece/speaker.h>

#include <iostream>

int main(int argc, char** argv) {
  const std::string text = argc > 1 ? argv[1] : "the time is now";
  const std::string file = argc > 2 ? argv[2] : "talk.glb";
  try {
    mouthpiece::Speaker speaker;
    const mouthpiece::Performance line = speaker.perform(text);
    mouthpiece::save(line, file);
    std::cout << line.duration() << " s of speech by " << line.voice() << ", " << line.units().size() << " units";
    for (const mouthpiece::PerformedUnit& unit : line.units()) {
      std::cout << "\n ";
      for (std::size_t i = unit.first; i <= unit.last; ++i) std::cout << ' ' << line.labels().phones[i].phone;
      std::cout << " from " << (unit.take.empty() ? "curves" : unit.take);
    }
    std::cout << "\nwrote " << file << '\n';
  } catch (const mouthpiece::InputError& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
