# mouthpiece_library(NAME PUBLIC_HEADERS a.h ... SOURCES a.cpp ... [APART b.cpp ...] [LINKS PUBLIC x PRIVATE y])
# A room of the tree as a static library. PUBLIC_HEADERS are those that other rooms may include; LINKS names exactly
# what the room's files include (tests/architecture reads both lists), so that the library links alone. With
# MOUTHPIECE_UNITY the SOURCES that are listed as APART, too, are compiled as one of their own: in rooms where some see
# a FaceMesh and many do not, so that a change of it leaves half of the room alone.
define_property(GLOBAL PROPERTY MOUTHPIECE_ROOMS BRIEF_DOCS "All rooms of the tree, as targets")
function(mouthpiece_library name)
  cmake_parse_arguments(ARG "" "" "PUBLIC_HEADERS;SOURCES;APART;LINKS" ${ARGN})
  add_library(mouthpiece_${name} STATIC ${ARG_SOURCES})
  add_library(mouthpiece::${name} ALIAS mouthpiece_${name})
  target_include_directories(mouthpiece_${name} PUBLIC ${CMAKE_SOURCE_DIR}/include ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR})
  target_link_libraries(mouthpiece_${name} ${ARG_LINKS})
  if(name MATCHES "^programs_")
    mouthpiece_compile_options(mouthpiece_${name} programs)
  else()
    mouthpiece_compile_options(mouthpiece_${name})
  endif()
  mouthpiece_unity(mouthpiece_${name} "${ARG_SOURCES}" "${ARG_APART}")
  set_property(GLOBAL APPEND PROPERTY MOUTHPIECE_ROOMS mouthpiece_${name})
endfunction()

function(mouthpiece_unity target sources apart)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${MOUTHPIECE_UNITY} UNITY_BUILD_MODE GROUP)
  list(REMOVE_ITEM sources ${apart})
  set_source_files_properties(${sources} PROPERTIES UNITY_GROUP together)
  set_source_files_properties(${apart} PROPERTIES UNITY_GROUP apart)
endfunction()

# mouthpiece_program(NAME SOURCES ... [APART ...] LINKS ...)
function(mouthpiece_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;APART;LINKS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR}/include ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR})
  # What a room names and a program does not use is not loaded when it starts.
  target_link_options(${name} PRIVATE "LINKER:--as-needed")
  target_link_libraries(${name} PRIVATE ${ARG_LINKS})
  mouthpiece_compile_options(${name} programs)
  mouthpiece_unity(${name} "${ARG_SOURCES}" "${ARG_APART}")
endfunction()

# mouthpiece_test(NAME [SOURCES ...] [SUPPORT ...] LINKS ... [LABELS ...] [PROGRAMS ...]): one GoogleTest executable, its
# tests registered with CTest. Without SOURCES: every .cpp of the folder. SUPPORT names files of tests/support, PROGRAMS
# what the tests run. Tests find the checkout through MOUTHPIECE_SOURCE_DIR, the programs through MOUTHPIECE_BIN_DIR.
function(mouthpiece_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;SUPPORT;LINKS;LABELS;PROGRAMS" ${ARGN})
  if(NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  endif()
  list(TRANSFORM ARG_SUPPORT REPLACE "(.+)" "${CMAKE_SOURCE_DIR}/tests/support/\\1.cpp")
  add_executable(${name} ${ARG_SOURCES} ${ARG_SUPPORT})
  target_link_libraries(${name} PRIVATE ${ARG_LINKS} GTest::gtest GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE
    MOUTHPIECE_SOURCE_DIR="${CMAKE_SOURCE_DIR}" MOUTHPIECE_BIN_DIR="${CMAKE_BINARY_DIR}/bin"
    MOUTHPIECE_BUILD_SHARE_DIR="${MOUTHPIECE_SHARE_DIR}")
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR}/include ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR} ${CMAKE_SOURCE_DIR}/tests)
  # Eight sources at a time, or g++ would take gigabytes: names in their anonymous namespaces may meet.
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test_bin
    UNITY_BUILD ${MOUTHPIECE_UNITY} UNITY_BUILD_BATCH_SIZE 8)
  mouthpiece_compile_options(${name} tests)
  if(ARG_PROGRAMS)
    add_dependencies(${name} ${ARG_PROGRAMS})
  endif()
  if(NOT name MATCHES "^unit_")  # long ones, side by side
    gtest_discover_tests(${name} TEST_PREFIX "${name}." PROPERTIES TIMEOUT 600 LABELS "${ARG_LABELS}"
      DISCOVERY_TIMEOUT 60)
    return()
  endif()
  set(found ${CMAKE_CURRENT_BINARY_DIR}/${name}_tests.cmake)
  list(TRANSFORM ARG_SOURCES REPLACE "^([^/].*)$" "${CMAKE_CURRENT_SOURCE_DIR}/\\1" OUTPUT_VARIABLE sources)
  add_custom_command(TARGET ${name} POST_BUILD BYPRODUCTS ${found} VERBATIM
    COMMAND ${CMAKE_COMMAND} -DNAME=${name} -DPROGRAM=$<TARGET_FILE:${name}> "-DSOURCES=${sources}"
            "-DLABELS=${ARG_LABELS}" -DOUTPUT=${found} -P ${CMAKE_SOURCE_DIR}/cmake/DiscoverTests.cmake)
  set(include ${CMAKE_CURRENT_BINARY_DIR}/${name}_include.cmake)
  file(WRITE ${include} "if(EXISTS [=[${found}]=])\n  include([=[${found}]=])\nelse()\n  add_test([=[${name}_NOT_BUILT]=] [=[${name}_NOT_BUILT]=])\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${include})
endfunction()

# mouthpiece_count_allocations(TEST): for tests/support/allocations.h.
function(mouthpiece_count_allocations test)
  foreach(function malloc calloc realloc _Znwm _ZnwmSt11align_val_t)
    target_link_options(${test} PRIVATE "LINKER:--wrap=${function}")
  endforeach()
endfunction()

# mouthpiece_embed(TARGET SYMBOL FILE): FILE's bytes as `extern const std::string_view mouthpiece::SYMBOL`.
function(mouthpiece_embed target symbol file)
  get_filename_component(path ${file} ABSOLUTE)
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/${symbol}.cpp)
  add_custom_command(OUTPUT ${generated}
    COMMAND ${CMAKE_COMMAND} -DSYMBOL=${symbol} -DINPUT=${path} -DOUTPUT=${generated}
            -P ${CMAKE_SOURCE_DIR}/cmake/EmbedFile.cmake
    DEPENDS ${path} ${CMAKE_SOURCE_DIR}/cmake/EmbedFile.cmake VERBATIM)
  set_source_files_properties(${generated} PROPERTIES UNITY_GROUP together)
  target_sources(${target} PRIVATE ${generated})
endfunction()

# What nearly every source includes is parsed once; all targets share it. The programs, whose time goes into reading
# command lines, have CLI11 in theirs, tests GoogleTest, and both are optimised less (docs/decisions/0004-build-time.md).
function(mouthpiece_precompile)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/precompiled/precompiled.cpp CONTENT "")  # written once: all that is compiled waits for it
  set(kinds "" _programs)
  if(TARGET GTest::gtest)
    list(APPEND kinds _tests)
  endif()
  foreach(kind IN LISTS kinds)
    set(target mouthpiece_precompiled${kind})
    add_library(${target} OBJECT ${CMAKE_BINARY_DIR}/precompiled/precompiled.cpp)
    target_link_libraries(${target} PRIVATE Eigen3::Eigen fmt::fmt)
    mouthpiece_compile_options(${target})
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map>
      <memory> <optional> <span> <string> <string_view> <vector> <Eigen/Core> <Eigen/Geometry> <fmt/format.h>)
  endforeach()
  target_link_libraries(mouthpiece_precompiled_programs PRIVATE CLI11::CLI11)
  target_compile_options(mouthpiece_precompiled_programs PRIVATE -O1)
  target_precompile_headers(mouthpiece_precompiled_programs PRIVATE <CLI/CLI.hpp>)
  if(TARGET mouthpiece_precompiled_tests)
    target_link_libraries(mouthpiece_precompiled_tests PRIVATE GTest::gtest)
    target_compile_options(mouthpiece_precompiled_tests PRIVATE -O1)
    target_precompile_headers(mouthpiece_precompiled_tests PRIVATE <fstream> <gtest/gtest.h>)
  endif()
endfunction()

# mouthpiece_compile_options(TARGET [programs | tests])
function(mouthpiece_compile_options target)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "EXECUTABLE")  # compiled as a library is, or the precompiled header would not do
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    target_compile_options(${target} PRIVATE -fPIC)
  endif()
  if(ARGN)
    target_compile_options(${target} PRIVATE -O1)
    target_precompile_headers(${target} REUSE_FROM mouthpiece_precompiled_${ARGN})
  elseif(NOT target MATCHES "^mouthpiece_precompiled")
    target_precompile_headers(${target} REUSE_FROM mouthpiece_precompiled)
  endif()
  # ccache asks for the first; by the second g++ looks for garbage in its memory from 1 GB on, which takes less time (docs/decisions/0004).
  target_compile_options(${target} PRIVATE "$<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess;--param=ggc-min-heapsize=1000000>")
  target_compile_definitions(${target} PRIVATE FMT_SHARED)  # as fmt::fmt has it: all share one precompiled header
  if(CMAKE_CXX_FLAGS MATCHES "--coverage" AND (ARGN STREQUAL "tests" OR target MATCHES "_tests$"))
    target_compile_options(${target} PRIVATE -fno-profile-arcs -fno-test-coverage)  # their own lines are not counted
  endif()
  mouthpiece_warnings(${target})
endfunction()

# mouthpiece_warnings(TARGET): and what makes its numbers the same everywhere.
function(mouthpiece_warnings target)
  # Contracted multiply-adds would make results depend on the compiler's mood.
  target_compile_options(${target} PRIVATE -ffp-contract=off -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
    -Wnon-virtual-dtor
    -Woverloaded-virtual -Wcast-qual
    # g++ 12 sees overlaps in std::string that are not there (gcc bugs 105651, 105329).
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>
    # In a unity build a source is included, so that its anonymous namespace looks like one of a header.
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${MOUTHPIECE_UNITY}>>:-Wno-subobject-linkage>)
  # What users run is the same bytes from every folder (tools/reproducible.sh).
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-ffile-prefix-map=${CMAKE_SOURCE_DIR}/=>)
  if(MOUTHPIECE_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# mouthpiece_rooms_of(SOURCE OUT): the rooms whose headers SOURCE includes, so that a target of one file builds no others.
function(mouthpiece_rooms_of source out)
  file(REAL_PATH ${source} source)
  file(STRINGS ${source} includes REGEX "^#include \"[^\"]+/[^/\"]+\"")
  set(rooms)
  foreach(include ${includes})
    string(REGEX REPLACE "^#include \"(.*)/[^/]*\".*" "\\1" folder "${include}")
    string(REPLACE "/" "_" room "${folder}")
    if(TARGET mouthpiece_${room})
      list(APPEND rooms mouthpiece::${room})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES rooms)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
  set(${out} ${rooms} PARENT_SCOPE)
endfunction()
