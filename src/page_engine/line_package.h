#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exports/shapes/principal_shapes.h"
#include "retarget/rig/face_file.h"
#include "retarget/rig/face_rig.h"
#include "synthesis/synthesis.h"
#include "units/file/corpus.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// A face's shapes at some of the vertices that move, enough to find the weights that come nearest to a pose.
struct ShapeSample {
  std::vector<std::uint32_t> vertices;
  RowMajorMatrixF shapes;  ///< shapes x (3 * vertices), mesh unit; the first shape's weight is always 1
};

/// What a page needs to make its line again after an edit, without the corpus: CBOR
/// (docs/decisions/0013-portable-core.md).
struct LinePackage {
  /// `labels` before any border was moved, no edits, and of the sound how long it lasts and, where it moves the lips,
  /// its measures.
  SynthesisRequest request;
  SynthesisPlan plan;  ///< before any unit was taken from elsewhere
  /// Of the takes, those that hold a pair of the line's phones, in their order; `take_source` knows the motion of
  /// those that the line and the page's offers are taken from (InputError for others), and the shapes of the line's
  /// pairs.
  Corpus corpus;
  FaceFile face;
  std::shared_ptr<const FaceMesh> mesh;
  ActorPose actor;
  ShapeSample sample;
};

/// What a LinePackage is made of. Views only.
struct LineToPack {
  const SynthesisRequest& request;  ///< its own sound; `curves.model` is the database's
  const SynthesisPlan& plan;
  const UnitDatabase& database;
  std::span<const TakeIndex> takes;  ///< whose motion is wanted besides the plan's
  const FaceFile& face;
  const FaceMesh& mesh;
  const ActorPose& actor;
  const PrincipalShapes& shapes;
};

/// Why a line cannot be made again in a page; "" when it can. Songs, lines drawn in a style, with the corpus' own
/// voice, or with an upper face from the corpus cannot.
std::string_view whyNotPacked(const SynthesisRequest& request);
/// `line` can be packed.
std::string packLine(const LineToPack& line);
/// Reads what nobody has checked. Throws InputError, with `name` in front.
LinePackage parseLinePackage(std::string_view bytes, const std::string& name);

}  // namespace mouthpiece
