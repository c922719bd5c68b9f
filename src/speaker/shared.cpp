// Corpora and faces that speakers share.
#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "mouthpiece/corpus.h"
#include "mouthpiece/face.h"
#include "speaker/shared_files.h"
#include "speaker/speaker_data.h"
#include "synthesis/lips.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kMakeFace = "make the sample face with `make data` in the checkout, or name another";

}  // namespace

SharedCorpus::Data::Data(const std::filesystem::path& file)
    : path(corpusFile(file)),
      corpus(readCorpus(path, CorpusAudio::kSkip, CorpusMotion::kTakesOnDemand)),
      units(corpus),
      curve_model(units),
      actor{corpus.neutral_pose_mm, closedLipsMm(corpus), unseenRounding(corpus)} {}

SharedCorpus::SharedCorpus(const std::filesystem::path& file) : data_(std::make_shared<const Data>(file)) {}
const std::string& SharedCorpus::name() const { return data_->corpus.name; }
std::size_t SharedCorpus::takeCount() const { return mouthpiece::takeCount(data_->corpus); }
std::vector<std::string> SharedCorpus::markerNames() const { return data_->corpus.layout.markerNames(); }

SharedFace::Data::Data(const std::filesystem::path& face_file)
    : path(face_file.empty() ? findSharedFile("default.face", kMakeFace) : face_file),
      file(readFaceFile(path)),
      rig_(std::async([this, bytes = readMeshBytesOf(file, path)]() mutable {
        const std::string mesh = std::move(bytes);  // what a future was made of lives as long as it does
        return FaceRig::of(file, meshOf(file, path, mesh), path.string());
      })) {}

std::filesystem::path SharedFace::Data::meshPath() const { return path.parent_path() / file.mesh_file; }

const std::vector<Triangle>& SharedFace::Data::triangles() const { return rig().mesh().triangles; }

SharedFace::SharedFace(const std::filesystem::path& file) : data_(std::make_shared<const Data>(file)) {}
const std::string& SharedFace::name() const { return data_->rig().name(); }
std::size_t SharedFace::vertexCount() const { return unsignedIndex(data_->rig().restVertices().rows()); }
double SharedFace::metresPerUnit() const { return data_->rig().metresPerUnit(); }

std::span<const float> SharedFace::restVertices() const {
  const VertexPositions& rest = data_->rig().restVertices();
  return {rest.data(), unsignedIndex(rest.size())};
}

std::vector<std::uint32_t> SharedFace::triangles() const {
  std::vector<std::uint32_t> corners;
  for (const Triangle& triangle : data_->triangles()) corners.insert(corners.end(), triangle.begin(), triangle.end());
  return corners;
}

}  // namespace mouthpiece
