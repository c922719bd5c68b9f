#pragma once

#include <Eigen/Core>

#include "base/time.h"

namespace mouthpiece {

/// How likely each phone is at each time of a sound, whatever is said, by what the encoder of a network of words makes
/// of it: a perceptron over five of its frames (docs/theory/hearing/recognition.md#phones-of-the-network).
/// `encoded`: WordNetwork::encode(), with a frame or more. Rows: phones by their number; a column every
/// WordNetwork::kEncodedStep; columns add up to 1.
Eigen::MatrixXf phonesOfEncoded(const Eigen::MatrixXf& encoded);

/// `phones`, of phonesOfEncoded(), at the times of `count` of an ear's frames (kEarStep, kEarShift), which begins
/// `first` frames after the ear's sound; the encoded sound begins at `start` of it.
Eigen::MatrixXf atFramesOfEar(const Eigen::MatrixXf& phones, Seconds start, Eigen::Index first, Eigen::Index count);

/// How likely each phone is by an ear (PhoneEar) and by the network, in the same frames.
Eigen::MatrixXf heardByBoth(const Eigen::Ref<const Eigen::MatrixXf>& by_ear,
                            const Eigen::Ref<const Eigen::MatrixXf>& by_network);

}  // namespace mouthpiece
