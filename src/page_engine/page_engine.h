#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

/// Makes the line of a page again after an edit, from a LinePackage alone: borders, units, curves and dials; words are
/// left to `synth`. The fragments stay those that were chosen for the line as it was, where no edit names others.
class PageEngine {
 public:
  /// Throws InputError for what is no package of this version.
  explicit PageEngine(std::string_view package);
  ~PageEngine();
  PageEngine(const PageEngine&) = delete;
  PageEngine& operator=(const PageEngine&) = delete;

  /// `edits`: all of them, as a file of docs/formats/edits.md. Throws InputError for what is none and for a take that
  /// the package does not hold; the line that was made before is still there then.
  void render(std::string_view edits);

  // Of the line that was made last; at least one was.
  [[nodiscard]] std::size_t frameCount() const;
  /// frames x shapes: the weights of the page's shapes that come nearest to each frame.
  [[nodiscard]] const RowMajorMatrixF& weights() const;
  /// frames x (3 * the face's markers), metres.
  [[nodiscard]] const RowMajorMatrixF& markers() const;
  /// Vertices x 3 of a frame, mesh unit.
  [[nodiscard]] const std::vector<float>& vertices(std::size_t frame);
  /// A sentence a line, of edits that do not apply.
  [[nodiscard]] const std::string& warnings() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace mouthpiece
