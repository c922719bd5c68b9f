#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>

#include "base/time.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/network/word_network.h"
#include "phonetics/language/language.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {

/// How likely each phone is at each time of a sound, whatever is said, by what the encoder of a network of words makes
/// of it: a perceptron over five of its frames (docs/theory/hearing/network_phones.md).
/// `encoded`: WordNetwork::encode(), with a frame or more. `language`: that is spoken; what is heard of others than
/// English is told by what people say there where such is heard
/// (docs/theory/hearing/network_phones.md#other-languages).
/// Rows: phones by their number; a column every WordNetwork::kEncodedStep; columns add up to 1.
Eigen::MatrixXf phonesOfEncoded(const Eigen::MatrixXf& encoded, const Language& language);

/// `phones`, of phonesOfEncoded(), at the times of `count` of an ear's frames (kEarStep, kEarShift), which begins
/// `first` frames after the ear's sound; the encoded sound begins at `start` of it.
Eigen::MatrixXf atFramesOfEar(const Eigen::MatrixXf& phones, Seconds start, Eigen::Index first, Eigen::Index count);

/// Whether a phone is likelier than silence in a frame: a column of HeardPhones.
inline bool isPhone(const Eigen::Ref<const Eigen::VectorXf>& frame) {
  return frame(static_cast<Eigen::Index>(Phone::kSil)) < 0.5F;
}

/// What `network` hears of a sound's phones, 16 kHz, in parts of 18 s: a column every kEarStep from kEarShift on, to
/// the sound's end; the same for all phones where it is too short. Throws InputError where the network cannot.
HeardPhones hearPhones(WordNetwork& network, std::span<const std::int16_t> samples, const Language& language);

/// The same where an acoustic model alone tells too little of how words of `language` lie in a sound: in noise
/// (noisinessOf), and in all languages but English, whose sounds it never learnt. None elsewhere, and where the network
/// is not there or cannot, which `fault` then says.
HeardPhones phonesBesideText(WordNetwork& network, std::span<const std::int16_t> samples, const Language& language,
                             std::string& fault);

/// How likely each phone is by an ear (PhoneEar) and by the network, in the same frames, of a sound as noisy as
/// noisinessOf() tells: the ear counts less there, and in another `language` than English.
Eigen::MatrixXf heardByBoth(const Eigen::Ref<const Eigen::MatrixXf>& by_ear,
                            const Eigen::Ref<const Eigen::MatrixXf>& by_network, double noisiness,
                            const Language& language);

}  // namespace mouthpiece
