#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>

#include "base/json_fields.h"

namespace mouthpiece {

struct FaceMesh;

/// What of a mesh moves: its vertices, triangles, the kinds of its parts, its unit; with `looks` all of it.
nlohmann::json meshToJson(const FaceMesh& mesh, bool looks);
/// Throws InputError for triangles and parts that do not fit together.
std::shared_ptr<const FaceMesh> meshFrom(const JsonField& field);

}  // namespace mouthpiece
