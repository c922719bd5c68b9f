# The actor model, and the sample corpus that it performs (docs/theory/actor_model.md).
mouthpiece_library(actor
  SOURCES actor/actor_expression.cpp actor/actor_model.cpp actor/actor_performance.cpp actor/sample_capture.cpp
    actor/sample_corpus.cpp actor/sample_sentences.cpp
  LINKS PUBLIC mouthpiece::base mouthpiece::motion mouthpiece::audio mouthpiece::phonetics mouthpiece::units
        PRIVATE mouthpiece::voices fmt::fmt nlohmann_json::nlohmann_json)
mouthpiece_embed(mouthpiece_actor kSampleActorJson ${CMAKE_SOURCE_DIR}/sample_data/actor/grid_s1_actor.json)
mouthpiece_embed(mouthpiece_actor kSampleSentences ${CMAKE_SOURCE_DIR}/sample_data/prompts/time55.txt)

# Learning it: a tool of the developers, not one of the three programs.
mouthpiece_library(actor_fit
  SOURCES actor/actor_basis.cpp actor/actor_capture.cpp actor/actor_fit.cpp
  LINKS PUBLIC mouthpiece::actor mouthpiece::corpus_tools PRIVATE fmt::fmt)
mouthpiece_program(fit_actor SOURCES actor/actor_fit_main.cpp LINKS mouthpiece::actor_fit CLI11::CLI11 fmt::fmt)
set_target_properties(fit_actor PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tools)
