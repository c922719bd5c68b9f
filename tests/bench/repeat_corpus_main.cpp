// repeat_corpus IN.corpus TIMES OUT.corpus: a corpus of hours for trying how opening and selection grow.
#include <cstdlib>
#include <iostream>

#include "base/errors.h"
#include "support/repeated_corpus.h"

int main(int argc, char** argv) {
  const int times = argc == 4 ? std::atoi(argv[2]) : 0;
  if (times < 1) {
    std::cerr << "usage: repeat_corpus IN.corpus TIMES OUT.corpus\n";
    return 2;
  }
  try {
    const mouthpiece::Corpus original = mouthpiece::readCorpus(argv[1]);
    mouthpiece::writeCorpus(argv[3], mouthpiece::samples::repeatedCorpus(original, static_cast<std::size_t>(times)));
  } catch (const mouthpiece::InputError& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
