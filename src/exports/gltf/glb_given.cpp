// Shapes and weights written into a GLB that was given.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/glb_scene.h"
#include "exports/gltf/glb.h"
#include "exports/gltf/glb_model.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

class SpeechAdder {
 public:
  SpeechAdder(std::string_view glb, const std::string& file, std::span<const std::string> shape_names = {})
      : glb_(glb), file_(file), model_(glb, file), shape_names_(shape_names) {
    if (!model_.hasData()) return;
    const std::map<std::size_t, std::size_t> removed = model_.removeSpeech();
    const json& nodes = model_.root["nodes"];
    for (std::size_t node = 0; !removed.empty() && node < nodes.size(); ++node) {
      if (!nodes[node].contains("mesh")) continue;
      const auto lost = removed.find(nodes[node]["mesh"].get<std::size_t>());
      if (lost != removed.end()) widened_[node] = {targetCount(meshOf(node)), lost->second, 0};
    }
  }

  [[nodiscard]] bool hasData() const { return model_.hasData(); }

  void addShapes(const PrincipalShapes& shapes, const Eigen::Matrix3d& upright_from_mesh, std::string_view object) {
    runs_ = glbRuns(glb_, file_, object);
    std::vector<Eigen::Index> columns(unsignedIndex(shapes.rest.cols() / 3), -1);
    const std::vector<std::uint32_t> vertices = shapes.columnVertices();
    for (std::size_t i = 0; i < vertices.size(); ++i) columns[vertices[i]] = 3 * signedIndex(i);
    if (runs_.empty() || runs_.back().first_vertex + runs_.back().count != columns.size())
      fail("has changed since the fit");
    std::map<int, std::vector<const GlbRun*>> runs_of_node;
    for (const GlbRun& run : runs_) {
      if (run.node >= 0) runs_of_node[run.node].push_back(&run);
    }
    MOUTHPIECE_EXPECT(shape_names_.empty() || signedIndex(shape_names_.size()) == shapes.shapeCount());
    std::map<int, std::set<Eigen::Index>> added;
    for (const auto& [node, runs] : runs_of_node) added[node] = movedBy(runs, shapes, columns);
    if (!shape_names_.empty()) completeNamed(shapes.shapeCount(), added);
    for (const auto& [node, runs] : runs_of_node)
      addToNode(unsignedIndex(node), runs, shapes, added.at(node), columns,
                upright_from_mesh.transpose().cast<float>());
  }

  /// Leaves what else the scene shows than `object` as it is.
  void keepTo(std::string_view object) { runs_ = glbRuns(glb_, file_, object); }

  /// In the place of animate(): other animations get room for the shapes, which rest.
  void leaveStill() { widenOthers(); }

  /// False when nothing moves.
  bool animate(std::size_t frames, double frame_rate_hz, const PrincipalShapes* shapes, const OwnShapeWeights* own) {
    widenOthers();
    std::vector<RowMajorMatrixF> values;
    std::vector<std::size_t> nodes;
    json& list = model_.root["nodes"];
    for (std::size_t node = 0; list.is_array() && node < list.size(); ++node) {
      if (!list[node].contains("mesh") || !isOfObject(node)) continue;
      const auto added = added_of_node_.find(node);
      auto weights = weightsOf(node, frames, shapes, added == added_of_node_.end() ? nullptr : &added->second, own);
      if (!weights) continue;
      values.push_back(*std::move(weights));
      nodes.push_back(node);
    }
    if (nodes.empty()) return false;
    std::vector<SpeechTrack> tracks;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      tracks.push_back({{values[i].data(), unsignedIndex(values[i].size())}, {nodes[i]}});
    model_.addSpeech(frames, frame_rate_hz, tracks);
    return true;
  }

  std::string toBytes() && { return std::move(model_).toBytes(); }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, "", what); }

  json& meshOf(std::size_t node) {
    json& meshes = model_.root.at("meshes");
    const std::size_t number = model_.root.at("nodes").at(node).at("mesh").get<std::size_t>();
    if (number >= meshes.size()) fail("names a mesh that it does not hold");
    return meshes[number];
  }

  /// Every node is where nothing is known of the scene.
  [[nodiscard]] bool isOfObject(std::size_t node) const {
    return runs_.empty() || std::any_of(runs_.begin(), runs_.end(), [node](const GlbRun& run) {
             return run.node < 0 || unsignedIndex(run.node) == node;
           });
  }

  static std::size_t targetCount(const json& mesh) {
    const auto primitives = mesh.find("primitives");
    if (primitives == mesh.end() || primitives->empty()) return 0;
    return primitives->at(0).value("targets", json::array()).size();
  }

  /// What the file calls the mesh' targets: itself, or as UniVRM writes it, in its primitives.
  static json ownNames(const json& mesh) {
    const auto namesIn = [](const json& owner) {
      const json extras = owner.value("extras", json());
      return extras.is_object() ? extras.value("targetNames", json()) : json();
    };
    json names = namesIn(mesh);
    if (names.is_null() && targetCount(mesh) > 0) names = namesIn(mesh["primitives"][0]);
    return names.is_array() ? names : json::array();
  }

  /// The shapes that move any vertex of the runs.
  static std::set<Eigen::Index> movedBy(const std::vector<const GlbRun*>& runs, const PrincipalShapes& shapes,
                                        const std::vector<Eigen::Index>& columns) {
    std::set<Eigen::Index> numbers;
    for (const GlbRun* run : runs) {
      for (std::size_t v = 0; v < run->count; ++v) {
        const Eigen::Index column = columns[run->first_vertex + v];
        for (Eigen::Index k = 0; column >= 0 && k < shapes.shapeCount(); ++k) {
          if (!shapes.shapes.row(k).segment<3>(column).isZero(0)) numbers.insert(k);
        }
      }
    }
    return numbers;
  }

  /// Whoever asks for shapes by name finds each once: what the head has of a name stays its own, and what moves nothing
  /// of it (eyes that it has not) rests beside the others, in the mesh that has most of them.
  void completeNamed(Eigen::Index shape_count, std::map<int, std::set<Eigen::Index>>& added) {
    std::set<std::string> owned;
    for (const auto& [node, numbers] : added) {
      for (const json& name : ownNames(meshOf(unsignedIndex(node)))) {
        if (name.is_string()) owned.insert(name.get<std::string>());
      }
    }
    std::set<Eigen::Index> placed;
    for (auto& [node, numbers] : added) {
      std::erase_if(numbers, [&](Eigen::Index k) { return owned.contains(shape_names_[unsignedIndex(k)]); });
      placed.insert(numbers.begin(), numbers.end());
    }
    const auto fullest = std::max_element(added.begin(), added.end(), [](const auto& one, const auto& other) {
      return one.second.size() < other.second.size();
    });
    if (placed.empty()) return;
    for (Eigen::Index k = 0; k < shape_count; ++k) {
      if (!placed.contains(k) && !owned.contains(shape_names_[unsignedIndex(k)])) fullest->second.insert(k);
    }
  }

  void addToNode(std::size_t node, const std::vector<const GlbRun*>& runs, const PrincipalShapes& shapes,
                 const std::set<Eigen::Index>& numbers, const std::vector<Eigen::Index>& columns,
                 const Eigen::Matrix3f& mesh_from_upright) {
    if (numbers.empty()) return;  // shoes, and what else the face does not move
    ownMeshOf(node);
    json& mesh = meshOf(node);
    const std::size_t before = targetCount(mesh);
    std::map<std::size_t, std::vector<json>> targets;  // by primitive
    for (const GlbRun* run : runs) {
      const std::vector<json> own = targetsOf(*run, shapes, numbers, columns, mesh_from_upright);
      for (const std::size_t primitive : run->primitives) targets[primitive] = own;
    }
    json& primitives = mesh.at("primitives");
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      json& list = primitives[p]["targets"];
      if (list.is_null()) list = json::array();
      const auto own = targets.find(p);
      // Every primitive of a mesh has as many targets as the others: lines and points get some that rest.
      for (std::size_t i = 0; i < numbers.size(); ++i)
        list.push_back(own != targets.end() ? own->second[i] : restingTarget(primitives[p]));
    }
    nameTargets(mesh, before, numbers);
    for (json* owner : {&mesh, &model_.root["nodes"][node]}) {
      const auto weights = owner->find("weights");
      if (weights == owner->end() && owner != &mesh) continue;
      json& rest = (*owner)["weights"];
      if (rest.is_null()) rest = json::array();
      while (rest.size() < before) rest.push_back(0.0);
      for (std::size_t i = 0; i < numbers.size(); ++i) rest.push_back(0.0);
    }
    widened_[node].targets = before;
    widened_[node].added = numbers.size();
    added_of_node_[node] = {numbers.begin(), numbers.end()};
  }

  /// A mesh that other nodes show too would move in all of them: this node gets one of its own over the same data.
  void ownMeshOf(std::size_t node) {
    json& nodes = model_.root["nodes"];
    const json number = nodes[node]["mesh"];
    const auto shown = std::count_if(nodes.begin(), nodes.end(),
                                     [&](const json& other) { return other.value("mesh", json()) == number; });
    if (shown < 2) return;
    json copy = meshOf(node);
    given_mesh_[node] = number.get<std::size_t>();
    nodes[node]["mesh"] = model_.root["meshes"].size();
    model_.root["meshes"].push_back(std::move(copy));
  }

  json restingTarget(const json& primitive) {
    const std::size_t position = primitive.at("attributes").at("POSITION").get<std::size_t>();
    const std::size_t count = model_.root.at("accessors").at(position).at("count").get<std::size_t>();
    return {{"POSITION", model_.addMostlyZeroVec3({}, {}, count, GlbUse::kMove)}};
  }

  std::vector<json> targetsOf(const GlbRun& run, const PrincipalShapes& shapes, const std::set<Eigen::Index>& numbers,
                              const std::vector<Eigen::Index>& columns, const Eigen::Matrix3f& mesh_from_upright) {
    std::vector<Eigen::Matrix3f> turns;
    for (const Eigen::Matrix3f& scene_from_mesh : run.scene_from_mesh) {
      if (!(std::abs(scene_from_mesh.determinant()) > 0)) fail("shows the face through a transform without depth");
      turns.emplace_back(scene_from_mesh.inverse() * mesh_from_upright);
    }
    std::vector<json> list;
    std::vector<std::uint32_t> moved;
    std::vector<float> values;
    for (const Eigen::Index k : numbers) {
      moved.clear();
      values.clear();
      for (std::uint32_t v = 0; v < run.count; ++v) {
        const Eigen::Index column = columns[run.first_vertex + v];
        if (column < 0 || shapes.shapes.row(k).segment<3>(column).isZero(0)) continue;
        const Eigen::Vector3f move =
            turns[turns.size() == 1 ? 0 : v] * shapes.shapes.row(k).segment<3>(column).transpose();
        moved.push_back(v);
        values.insert(values.end(), move.begin(), move.end());
      }
      list.push_back({{"POSITION", model_.addMostlyZeroVec3(moved, values, run.count, GlbUse::kMove)}});
    }
    return list;
  }

  /// What Blender, three.js and others read names from. Own targets without any are called as these programs do.
  void nameTargets(json& mesh, std::size_t before, const std::set<Eigen::Index>& numbers) const {
    json names = ownNames(mesh);
    while (names.size() > before) names.erase(names.size() - 1);
    while (names.size() < before) names.push_back(fmt::format("target_{}", names.size()));
    for (const Eigen::Index k : numbers) {
      names.push_back(shape_names_.empty() ? fmt::format("speech_{:02}", k) : shape_names_[unsignedIndex(k)]);
    }
    json& extras = mesh["extras"];
    if (!extras.is_object()) extras = json::object();
    extras["targetNames"] = std::move(names);
  }

  /// The keys of the other animations of weights get room for the new targets.
  void widenOthers() {
    std::set<std::size_t> outputs;
    for (const json& animation : model_.root.value("animations", json::array())) {
      for (const json& channel : animation.at("channels")) {
        const json& target = channel.at("target");
        if (target.value("path", "") != "weights" || !widened_.contains(target.value("node", std::size_t{0}))) continue;
        outputs.insert(
            animation.at("samplers").at(channel.at("sampler").get<std::size_t>()).at("output").get<std::size_t>());
      }
    }
    if (outputs.empty()) return;
    const std::vector<std::size_t> list(outputs.begin(), outputs.end());
    const std::vector<std::vector<float>> keys = glbScalars(glb_, file_, list);
    model_.widenWeights(
        [&](std::size_t accessor) {
          return keys.at(unsignedIndex(std::lower_bound(list.begin(), list.end(), accessor) - list.begin()));
        },
        widened_);
  }

  /// What the target of a node's mesh is; "" for none of the file's.
  const std::string& ownName(std::size_t node, std::size_t target) {
    static const std::string none;
    if (!own_names_) own_names_ = glbShapeNames(glb_, file_);
    const auto given = given_mesh_.find(node);
    const std::size_t mesh =
        given != given_mesh_.end() ? given->second : model_.root["nodes"][node]["mesh"].get<std::size_t>();
    return mesh < own_names_->size() && target < (*own_names_)[mesh].size() ? (*own_names_)[mesh][target] : none;
  }

  /// frames x targets of the node's mesh; nullopt where none of them moves.
  std::optional<RowMajorMatrixF> weightsOf(std::size_t node, std::size_t frames, const PrincipalShapes* shapes,
                                           const std::vector<Eigen::Index>* added, const OwnShapeWeights* own) {
    const json& mesh = meshOf(node);
    const std::size_t count = targetCount(mesh), before = count - (added != nullptr ? added->size() : 0);
    const json& rests = model_.root["nodes"][node].contains("weights") ? model_.root["nodes"][node]["weights"]
                                                                       : mesh.value("weights", json::array());
    RowMajorMatrixF weights = RowMajorMatrixF::Zero(signedIndex(frames), signedIndex(count));
    bool moves = added != nullptr;
    for (std::size_t k = 0; k < before; ++k) {
      const int column = own != nullptr ? own->column_of(ownName(node, k)) : -1;
      const float rest = k < rests.size() && rests[k].is_number() ? rests[k].get<float>() : 0.0F;
      weights.col(signedIndex(k)).setConstant(rest);
      // The head was read with what its file leaves up, and what moves it goes on from there.
      if (column >= 0)
        weights.col(signedIndex(k)) =
            (weights.col(signedIndex(k)) + own->weights.col(column)).cwiseMin(std::max(1.0F, rest));
      moves = moves || column >= 0;
    }
    for (std::size_t i = 0; added != nullptr && i < added->size(); ++i)
      weights.col(signedIndex(before + i)) = shapes->weights.col((*added)[i]);
    if (!moves) return std::nullopt;
    return weights;
  }

  std::string_view glb_;
  const std::string& file_;
  GlbModel model_;
  std::span<const std::string> shape_names_;
  std::vector<GlbRun> runs_;
  std::optional<std::vector<std::vector<std::string>>> own_names_;  ///< glbShapeNames(), once asked for
  std::map<std::size_t, std::size_t> given_mesh_;                   ///< by node: the mesh that its copy is of
  std::map<std::size_t, GlbModel::Widening> widened_;               ///< by node
  std::map<std::size_t, std::vector<Eigen::Index>> added_of_node_;  ///< the shapes that its mesh got
};

/// JSON that does not hold what glTF asks for is bad input, wherever it shows.
template <typename Work>
auto checkedJson(const std::string& file, Work&& work) {
  try {
    return work();
  } catch (const json::exception&) {
    throw InputError(file, "", "holds JSON that is no glTF");
  }
}

}  // namespace

std::optional<std::string> glbWithShapes(std::string_view glb, const std::string& file, const PrincipalShapes& shapes,
                                         const Eigen::Matrix3d& upright_from_mesh, std::string_view object,
                                         const OwnShapeWeights* own, std::span<const std::string> shape_names) {
  return checkedJson(file, [&]() -> std::optional<std::string> {
    SpeechAdder adder(glb, file, shape_names);
    if (!adder.hasData() || shapes.shapeCount() == 0) return std::nullopt;
    adder.addShapes(shapes, upright_from_mesh, object);
    if (!shape_names.empty()) {
      adder.leaveStill();
      return std::move(adder).toBytes();
    }
    if (!adder.animate(unsignedIndex(shapes.frameCount()), shapes.frame_rate_hz, &shapes, own)) return std::nullopt;
    return std::move(adder).toBytes();
  });
}

std::optional<std::string> glbWithWeights(std::string_view glb, const std::string& file, double frame_rate_hz,
                                          const OwnShapeWeights& own, std::string_view object) {
  return checkedJson(file, [&]() -> std::optional<std::string> {
    SpeechAdder adder(glb, file);
    if (!adder.hasData()) throw InputError(file, "", "holds no mesh with shapes in its own binary chunk");
    if (!object.empty()) adder.keepTo(object);
    if (!adder.animate(unsignedIndex(own.weights.rows()), frame_rate_hz, nullptr, &own)) return std::nullopt;
    return std::move(adder).toBytes();
  });
}

}  // namespace mouthpiece
