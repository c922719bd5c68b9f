#pragma once

#include <flite/flite.h>

#include "base/late_library.h"

namespace mouthpiece {

inline constexpr const char* kFlitePackage = "libflite1";
inline constexpr LateLibrary kFlite("libflite.so.1", kFlitePackage);

// What is used of Flite, under its own names: within this namespace they hide those that a program would be linked to.
#define MOUTHPIECE_FLITE(function) inline constinit LateFunction<decltype(::function)> function(kFlite, #function)
MOUTHPIECE_FLITE(flite_init);
MOUTHPIECE_FLITE(default_textanalysis);
MOUTHPIECE_FLITE(default_tokenization);
MOUTHPIECE_FLITE(new_utterance);
MOUTHPIECE_FLITE(delete_utterance);
MOUTHPIECE_FLITE(utt_init);
MOUTHPIECE_FLITE(utt_set_input_text);
MOUTHPIECE_FLITE(utt_synth);
MOUTHPIECE_FLITE(utt_relation);
MOUTHPIECE_FLITE(utt_relation_present);
MOUTHPIECE_FLITE(utt_wave);
MOUTHPIECE_FLITE(relation_head);
MOUTHPIECE_FLITE(item_as);
MOUTHPIECE_FLITE(item_next);
MOUTHPIECE_FLITE(item_parent);
MOUTHPIECE_FLITE(item_feat_float);
MOUTHPIECE_FLITE(item_feat_string);
MOUTHPIECE_FLITE(feat_set);
MOUTHPIECE_FLITE(feat_val);
MOUTHPIECE_FLITE(new_audio_streaming_info);
MOUTHPIECE_FLITE(audio_streaming_info_val);
MOUTHPIECE_FLITE(lex_lookup);
MOUTHPIECE_FLITE(val_lexicon);
MOUTHPIECE_FLITE(val_car);
MOUTHPIECE_FLITE(val_cdr);
MOUTHPIECE_FLITE(val_string);
MOUTHPIECE_FLITE(delete_val);
#undef MOUTHPIECE_FLITE

/// An utterance's deleter.
struct FliteDeleter {
  void operator()(cst_utterance* utterance) const { delete_utterance(utterance); }
  void operator()(cst_val* list) const { delete_val(list); }
};

}  // namespace mouthpiece
