# The actor model, the sample corpus it performs (docs/theory/actor_model.md), and the program that learns its numbers.
mouthpiece_library(actor
  SOURCES actor_basis.cpp actor_capture.cpp actor_expression.cpp actor_fit.cpp actor_model.cpp actor_performance.cpp
    actor_segments.cpp sample_capture.cpp sample_corpus.cpp sample_sentences.cpp
  LINKS PUBLIC mouthpiece::corpus_tools mouthpiece::voices PRIVATE fmt::fmt nlohmann_json::nlohmann_json)
mouthpiece_embed(mouthpiece_actor kSampleActorJson ${CMAKE_SOURCE_DIR}/sample_data/actor/grid_s1_actor.json)
mouthpiece_embed(mouthpiece_actor kSampleSentences ${CMAKE_SOURCE_DIR}/sample_data/prompts/time55.txt)

mouthpiece_program(fit_actor SOURCES actor_fit_main.cpp LINKS mouthpiece::actor CLI11::CLI11 fmt::fmt)
set_target_properties(fit_actor PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tools)
