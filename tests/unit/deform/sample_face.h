#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece::samples {

/// A plain face for tests: half an egg with 66 markers, a mouth slit whose lips touch, lower teeth, a tongue and an
/// eye.
struct SampleFace {
  std::vector<std::string> names;
  MarkerPositions rest;  ///< mm
  std::map<std::string, Eigen::Vector3d> known;
  FaceMesh mesh;
  std::vector<bool> is_above_slit;  ///< of the skin's vertices: by where they were laid, not by distance along the mesh
  std::size_t skin_vertices = 0;
};

/// `spacing_mm` between the skin's vertices.
SampleFace makeSampleFace(double spacing_mm);
const SampleFace& sampleFace();
const ControlMesh& sampleControl();
const FaceBinding& sampleBinding();

/// Speech-like random offsets: the jaw opens, corners spread or purse, every marker trembles. Lengths in mm.
MarkerPositions randomPose(const SampleFace& face, std::mt19937& random);

/// The lower face lowered by `mm`.
MarkerPositions openMouth(const SampleFace& face, double mm);

/// Frames of the real capture as displacements from its neutral pose, head motion removed; empty where it is absent.
std::vector<MarkerPositions> capturedDisplacements(std::size_t takes, std::size_t every);

}  // namespace mouthpiece::samples
