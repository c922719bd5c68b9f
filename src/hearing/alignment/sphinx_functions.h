#pragma once

#include <pocketsphinx.h>
#include <ps_lattice.h>
#include <sphinxbase/cmn.h>
#include <sphinxbase/err.h>
#include <sphinxbase/feat.h>
#include <sphinxbase/fsg_model.h>
#include <sphinxbase/logmath.h>
#include <sphinxbase/ngram_model.h>

#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/late_library.h"

namespace mouthpiece {

/// It brings LAPACK, and where that is OpenBLAS' a thread for each core, which are busy for some time at the start.
inline constexpr LateLibrary kSphinx("libpocketsphinx.so.3", "libpocketsphinx3");

// What is used of PocketSphinx, under its own names: within this namespace they hide those that a program would be
// linked to.
#define MOUTHPIECE_SPHINX(function) inline constinit LateFunction<decltype(::function)> function(kSphinx, #function)
MOUTHPIECE_SPHINX(cmd_ln_float_r);
MOUTHPIECE_SPHINX(cmd_ln_free_r);
MOUTHPIECE_SPHINX(cmd_ln_parse_r);
MOUTHPIECE_SPHINX(cmd_ln_set_float_r);
MOUTHPIECE_SPHINX(cmn);
MOUTHPIECE_SPHINX(err_set_logfp);
MOUTHPIECE_SPHINX(fe_end_utt);
MOUTHPIECE_SPHINX(fe_get_output_size);
MOUTHPIECE_SPHINX(fe_process_frames);
MOUTHPIECE_SPHINX(fe_start_utt);
MOUTHPIECE_SPHINX(feat_array_alloc);
MOUTHPIECE_SPHINX(feat_array_free);
MOUTHPIECE_SPHINX(feat_s2mfc2feat_live);
MOUTHPIECE_SPHINX(fsg_model_free);
MOUTHPIECE_SPHINX(fsg_model_init);
MOUTHPIECE_SPHINX(fsg_model_null_trans_add);
MOUTHPIECE_SPHINX(fsg_model_null_trans_closure);
MOUTHPIECE_SPHINX(fsg_model_trans_add);
MOUTHPIECE_SPHINX(fsg_model_word_add);
MOUTHPIECE_SPHINX(glist_free);
MOUTHPIECE_SPHINX(logmath_free);
MOUTHPIECE_SPHINX(logmath_init);
MOUTHPIECE_SPHINX(logmath_log);
MOUTHPIECE_SPHINX(logmath_log_to_ln);
MOUTHPIECE_SPHINX(ngram_model_free);
MOUTHPIECE_SPHINX(ngram_model_read);
MOUTHPIECE_SPHINX(ngram_tg_score);
MOUTHPIECE_SPHINX(ngram_wid);
MOUTHPIECE_SPHINX(ps_add_word);
MOUTHPIECE_SPHINX(ps_args);
MOUTHPIECE_SPHINX(ps_end_utt);
MOUTHPIECE_SPHINX(ps_free);
MOUTHPIECE_SPHINX(ps_get_config);
MOUTHPIECE_SPHINX(ps_get_fe);
MOUTHPIECE_SPHINX(ps_get_feat);
MOUTHPIECE_SPHINX(ps_get_hyp);
MOUTHPIECE_SPHINX(ps_get_lattice);
MOUTHPIECE_SPHINX(ps_get_logmath);
MOUTHPIECE_SPHINX(ps_init);
MOUTHPIECE_SPHINX(ps_latlink_iter_link);
MOUTHPIECE_SPHINX(ps_latlink_iter_next);
MOUTHPIECE_SPHINX(ps_latlink_prob);
MOUTHPIECE_SPHINX(ps_latlink_times);
MOUTHPIECE_SPHINX(ps_latnode_baseword);
MOUTHPIECE_SPHINX(ps_latnode_exits);
MOUTHPIECE_SPHINX(ps_latnode_iter);
MOUTHPIECE_SPHINX(ps_latnode_iter_next);
MOUTHPIECE_SPHINX(ps_latnode_iter_node);
MOUTHPIECE_SPHINX(ps_lookup_word);
MOUTHPIECE_SPHINX(ps_process_cep);
MOUTHPIECE_SPHINX(ps_seg_frames);
MOUTHPIECE_SPHINX(ps_seg_iter);
MOUTHPIECE_SPHINX(ps_seg_next);
MOUTHPIECE_SPHINX(ps_seg_word);
MOUTHPIECE_SPHINX(ps_set_fsg);
MOUTHPIECE_SPHINX(ps_set_lm_file);
MOUTHPIECE_SPHINX(ps_set_search);
MOUTHPIECE_SPHINX(ps_start_utt);
#undef MOUTHPIECE_SPHINX

struct SphinxDeleter {
  void operator()(cmd_ln_t* config) const { cmd_ln_free_r(config); }
  void operator()(fsg_model_t* graph) const { fsg_model_free(graph); }
  void operator()(logmath_t* math) const { logmath_free(math); }
  void operator()(mfcc_t*** features) const { feat_array_free(features); }
  void operator()(ngram_model_t* model) const { ngram_model_free(model); }
  void operator()(ps_decoder_t* decoder) const { ps_free(decoder); }
};
template <typename Value>
using SphinxPointer = std::unique_ptr<Value, SphinxDeleter>;

/// A decoder by `options`, names and values in turn, which prints nothing; null where PocketSphinx makes none of them.
inline SphinxPointer<ps_decoder_t> makeSphinxDecoder(std::initializer_list<std::string> options) {
  static std::once_flag silenced;
  std::call_once(silenced, [] { err_set_logfp(nullptr); });
  std::vector<std::string> kept(options);
  std::vector<char*> words;
  for (std::string& word : kept) words.push_back(word.data());
  const SphinxPointer<cmd_ln_t> config(
      cmd_ln_parse_r(nullptr, ps_args(), static_cast<int>(words.size()), words.data(), TRUE));
  return SphinxPointer<ps_decoder_t>(config ? ps_init(config.get()) : nullptr);
}

}  // namespace mouthpiece
