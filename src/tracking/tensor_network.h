#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "tracking/tflite_model.h"

namespace mouthpiece {

/// A network that is ready to run, one thread at a time; XNNPACK computes its layers.
class TensorNetwork {
 public:
  /// The regions that MediaPipe's attention looks at more closely, in the order of the model's
  /// kLandmarksToMatrix steps: landmarks around each, the first and last of its lower edge telling how it is turned.
  struct Region {
    std::span<const int> landmarks;
    std::size_t right_end = 0, left_end = 0;
  };

  /// Throws InputError for a model that XNNPACK does not take; `name` is for messages.
  TensorNetwork(TfliteModel model, std::span<const Region> regions, std::string_view name);
  TensorNetwork(const TensorNetwork&) = delete;
  TensorNetwork& operator=(const TensorNetwork&) = delete;
  ~TensorNetwork();

  /// height x width x channels, to be filled before run().
  [[nodiscard]] std::span<float> input();
  void run();
  [[nodiscard]] std::size_t outputCount() const;
  /// Of the last run().
  [[nodiscard]] std::span<const float> output(std::size_t number) const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace mouthpiece
