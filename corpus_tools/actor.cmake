# The actor model and the sample corpus it performs (docs/theory/actor_model.md).
mouthpiece_library(actor
  SOURCES sample_sentences.cpp
  LINKS PUBLIC mouthpiece::base mouthpiece::motion mouthpiece::audio mouthpiece::phonetics
        PRIVATE mouthpiece::voices fmt::fmt nlohmann_json::nlohmann_json)
