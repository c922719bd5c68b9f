#include "singing/song_source.h"

#include <algorithm>

#include "hearing/tags/hear_tags.h"
#include "singing/song.h"
#include "singing/singing_voice.h"

namespace mouthpiece {
namespace {

std::vector<SungWord> wordsToSing(const Song& song) {
  std::vector<SungWord> words;
  for (const SongWord& word : song.words) {
    SungWord sung{word.text, {}, song.secondsOf(word.rest_beats)};
    for (const std::vector<SongNote>& syllable : word.syllables) {
      std::vector<SungTone>& tones = sung.syllables.emplace_back();
      for (const SongNote& note : syllable)
        tones.push_back({hzOfMidiPitch(note.midi_pitch), song.secondsOf(note.beats), note.vibrato});
    }
    words.push_back(std::move(sung));
  }
  return words;
}

}  // namespace

SungSource singSong(const std::filesystem::path& path, const Lexicon* lexicon) {
  const Song song = readSong(path);
  checkSong(song, path.string());
  SingingOptions options;
  options.lexicon = lexicon;
  SungLine sung = singWords(wordsToSing(song), song.secondsOf(song.first_rest_beats), options);
  SungSource source{std::move(sung.line), {}, {}};
  for (const TimedTone& tone : sung.tones) {
    source.tags.notes.push_back({tone.span, tone.hz});
    if (tone.vibrato) {
      const TimeSpan span{std::min(tone.span.start + options.vibrato.delay, tone.span.end), tone.span.end};
      if (span.duration() > 0)
        source.tags.vibrato.push_back({span, options.vibrato.rate_hz, options.vibrato.depth_semitones});
    }
  }
  return source;
}

SungSource hearSong(SpokenLine line) {
  SungSource source;
  source.tags = hearTags(line.audio, &line.labels);
  source.warnings = soundWarnings(line.audio, &line.labels, source.tags);
  source.line = std::move(line);
  return source;
}

}  // namespace mouthpiece
