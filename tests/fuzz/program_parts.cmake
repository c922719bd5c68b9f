# Fuzzers that read with sources of programs: no room links them, and each is linked in the ordinary build as well.
set(fuzzers_of_programs manifest_fuzz stream_input_fuzz tables_fuzz)
# mouthpiece_program_parts(TARGET FUZZER): TARGET gets the sources of programs that FUZZER reads with: they are no room's.
function(mouthpiece_program_parts target fuzzer)
  set(src ${CMAKE_SOURCE_DIR}/src)
  if(fuzzer STREQUAL stream_input_fuzz)
    target_sources(${target} PRIVATE ${src}/programs/synth/stream_input.cpp)
  elseif(fuzzer STREQUAL tables_fuzz)
    target_sources(${target} PRIVATE ${src}/programs/config_file.cpp ${src}/programs/synth/batch_list.cpp
      ${src}/programs/synth/batch_table.cpp ${src}/speaker/line.cpp)
    target_link_libraries(${target} PRIVATE fmt::fmt mouthpiece::hearing_alignment mouthpiece::phonetics_language
      mouthpiece::phonetics_text)
  elseif(fuzzer STREQUAL manifest_fuzz)
    target_sources(${target} PRIVATE ${src}/programs/synth/batch_manifest.cpp)
    target_link_libraries(${target} PRIVATE fmt::fmt nlohmann_json::nlohmann_json)
  endif()
endfunction()
