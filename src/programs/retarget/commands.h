#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "programs/program.h"
#include "retarget/rig/face_fit.h"

namespace mouthpiece {

struct Corpus;

// One source file a subcommand of `retarget`.
Command applyCommand();
Command checkCommand();
Command cutCommand();
Command fitCommand();
Command pickCommand();
Command sampleCommand();

/// What fitFace() needs to know of a corpus' actor; the mesh's file and hash are left to the caller.
FitRequest fitRequestFor(const std::string& face_name, const Corpus& corpus);

/// A fitted face and what checkFace() says of it, as JSON and as lines to read.
nlohmann::json faceFacts(const FaceFile& face, const FaceCheck& check);
std::string faceText(const FaceFile& face, const FaceCheck& check);
/// Either of them on stdout.
void printFace(const FaceFile& face, const FaceCheck& check, bool json, bool quiet);

}  // namespace mouthpiece
