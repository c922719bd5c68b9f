# The portable core: labels in, moving mesh out, of the same sources as the rooms, with libraries that are headers alone.
# With Emscripten (preset wasm) it is page_engine.wasm, which view.html runs; with clang and libc++ (preset portable) a
# library and those of the unit tests that need nothing else.

# Libraries that are compiled for this machine and libstdc++ must not be found by accident: only these headers are seen.
set(headers ${CMAKE_BINARY_DIR}/headers)
file(MAKE_DIRECTORY ${headers})
foreach(library eigen3 fmt nlohmann boost CGAL hwy)
  find_path(found_${library} NAMES ${library} PATHS /usr/include /usr/local/include NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)
  if(NOT found_${library})
    message(FATAL_ERROR "The headers of ${library} are missing. Get them with: make setup")
  endif()
  file(CREATE_LINK ${found_${library}}/${library} ${headers}/${library} SYMBOLIC)
endforeach()

file(GLOB core_sources CONFIGURE_DEPENDS
  src/audio/band_energy.cpp src/expression/*.cpp src/motion/*.cpp src/page_engine/package_options.cpp src/page_engine/package_reader.cpp src/page_engine/packed_mesh.cpp
  src/page_engine/page_engine.cpp src/phonetics/labels/speech_labels.cpp src/synthesis/*.cpp src/units/costs/*.cpp
  src/units/file/corpus.cpp src/units/phones/*.cpp src/units/prediction/*.cpp src/units/selection/*.cpp src/vocal/*.cpp
  deform/kernel/*.cpp deform/mouth/*.cpp deform/surface/*.cpp deform/topology/*.cpp retarget/warp/*.cpp)
list(FILTER core_sources EXCLUDE REGEX "/live_motion\\.cpp$")  # hears
# Faces are triangulated when they are fitted, by predicates that set the rounding mode, which WebAssembly has not.
list(FILTER core_sources EXCLUDE REGEX "/triangulation\\.cpp$")
foreach(name errors json_fields json_text matrix_solvers parallel_for rbf statistics text_encoding text_numbers)
  list(APPEND core_sources src/base/${name}.cpp)
endforeach()
foreach(name ipa phone)
  list(APPEND core_sources src/phonetics/language/${name}.cpp)
endforeach()
foreach(name face_mesh gums inner_parts mesh_parts polygons triangle_tree)
  list(APPEND core_sources deform/mesh/${name}.cpp)
endforeach()
foreach(name ball_fit eyeballs face_file face_file_mesh face_rig larynx missing_markers stored_mesh)
  list(APPEND core_sources retarget/rig/${name}.cpp)
endforeach()

function(mouthpiece_core_options target)
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/include ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR})
  target_include_directories(${target} SYSTEM PRIVATE ${headers} ${headers}/eigen3)
  # Eigen starts no threads of its own; one kind of processor needs no choice when the program starts.
  target_compile_definitions(${target} PRIVATE FMT_HEADER_ONLY EIGEN_DONT_PARALLELIZE HWY_COMPILE_ONLY_STATIC
    CGAL_DISABLE_ROUNDING_MATH_CHECK MOUTHPIECE_VERSION="${PROJECT_VERSION}")
  mouthpiece_warnings(${target})
  # Its addresses have 32 bits, so do Eigen's indices: what is no conversion elsewhere is one there.
  if(EMSCRIPTEN)
    target_compile_options(${target} PRIVATE -O2 -fwasm-exceptions -Wno-sign-conversion -Wno-shorten-64-to-32)
  endif()
endfunction()

add_library(mouthpiece_core STATIC ${core_sources})
mouthpiece_embed(mouthpiece_core kFace66LayoutJson sample_data/layouts/face66.json)
mouthpiece_embed(mouthpiece_core kArkitMarkersJson sample_data/arkit/face66_shapes.json)
mouthpiece_embed(mouthpiece_core kGenericPosesJson sample_data/visemes/generic_poses.json)
mouthpiece_core_options(mouthpiece_core)
# What nearly all of them include is parsed once; the portable build does without, and shows what is included by nobody.
if(EMSCRIPTEN)
  target_precompile_headers(mouthpiece_core PRIVATE <algorithm> <array> <cmath> <cstdint> <functional> <map> <memory>
    <optional> <span> <string> <string_view> <vector> <Eigen/Core> <Eigen/Geometry> <fmt/format.h>)
endif()
if(MOUTHPIECE_UNITY)  # a room's sources at a time: names of two rooms may meet
  foreach(source ${core_sources})
    get_filename_component(folder ${source} ABSOLUTE)
    file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR} ${folder})
    get_filename_component(folder ${folder} DIRECTORY)
    string(REPLACE "/" "_" folder ${folder})
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${folder})
  endforeach()
  # Their constants inside functions have names that other files of the room have outside: clang calls that shadowing.
  set_source_files_properties(deform/topology/head_topology.cpp deform/mesh/triangle_tree.cpp deform/topology/welding.cpp
    PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  set_target_properties(mouthpiece_core PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endif()

if(NOT EMSCRIPTEN)
  include(MouthpieceCoreTests)
  return()
endif()
add_executable(mouthpiece_page_engine)
add_subdirectory(src/page_engine)
mouthpiece_core_options(mouthpiece_page_engine)
target_link_libraries(mouthpiece_page_engine PRIVATE mouthpiece_core)
set_target_properties(mouthpiece_page_engine PROPERTIES OUTPUT_NAME page_engine SUFFIX .wasm)
target_link_options(mouthpiece_page_engine PRIVATE -O2 -fwasm-exceptions -sSTANDALONE_WASM --no-entry -sALLOW_MEMORY_GROWTH
  -sINITIAL_MEMORY=64MB)
