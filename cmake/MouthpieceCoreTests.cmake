# The portable core on this machine: its unit tests, with a GoogleTest that is built by the same compiler and library
# (Debian's sources of it), and with MOUTHPIECE_FUZZ the fuzz target that runs all of the core.
find_package(Threads REQUIRED)
add_library(mouthpiece_page_engine STATIC)  # what stands in for libraries and files
add_subdirectory(src/page_engine)
mouthpiece_core_options(mouthpiece_page_engine)
target_link_libraries(mouthpiece_page_engine PRIVATE mouthpiece_core)
target_link_libraries(mouthpiece_core PUBLIC mouthpiece_page_engine Threads::Threads)
if(MOUTHPIECE_TESTS)
  find_path(googletest_sources NAMES googletest/CMakeLists.txt PATHS /usr/src/googletest NO_DEFAULT_PATH)
  if(NOT googletest_sources)
    message(FATAL_ERROR "GoogleTest's sources are missing. Get them with: tools/setup.sh portable")
  endif()
  enable_testing()
  include(GoogleTest)
  add_subdirectory(${googletest_sources} ${CMAKE_BINARY_DIR}/googletest EXCLUDE_FROM_ALL)
  set(core_tests base/json_fields base/parallel_for base/rbf base/rbf_laws base/statistics base/text_encoding
    base/text_numbers deform/patch_kernel motion/blend motion/resample motion/time_warp page_engine/core
    vocal/animation_curve vocal/viseme_laws)
  list(TRANSFORM core_tests REPLACE "(.+)" "tests/unit/\\1_test.cpp")
  add_executable(core_tests ${core_tests})
  mouthpiece_core_options(core_tests)
  target_include_directories(core_tests PRIVATE ${CMAKE_SOURCE_DIR}/tests)
  target_compile_definitions(core_tests PRIVATE MOUTHPIECE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  target_link_libraries(core_tests PRIVATE mouthpiece_core gtest gtest_main)
  # One test reads a capture from beside the tree.
  gtest_discover_tests(core_tests TEST_PREFIX core. TEST_FILTER -*OnRealSpeech DISCOVERY_TIMEOUT 60)
endif()

if(MOUTHPIECE_FUZZ)
  add_executable(line_package_fuzz tests/fuzz/line_package_fuzz.cpp)
  mouthpiece_core_options(line_package_fuzz)
  target_link_libraries(line_package_fuzz PRIVATE mouthpiece_core)
  # libFuzzer itself is compiled for libstdc++, whose names are others than libc++'s.
  target_link_libraries(line_package_fuzz PRIVATE -l:libstdc++.so.6)  # by file: clang takes stdc++ for libc++
  target_link_options(line_package_fuzz PRIVATE -fsanitize=fuzzer)
endif()
