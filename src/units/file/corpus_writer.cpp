#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "units/file/corpus_tables.h"
#include "units/file/packed_rows.h"

namespace mouthpiece {
namespace {

static_assert(std::endian::native == std::endian::little, "blobs are little-endian and written as they lie in memory");

CheckedInsert inserter(SqliteDatabase& database, std::string_view name) {
  for (const CorpusTable& table : kCorpusTables) {
    if (table.name == name) return {database, std::string(name), table.columns};
  }
  throw InternalError(fmt::format("no corpus table {}", name));
}

/// Small files keep small pages; big ones read faster by big pages (15.7 MB of motion: 4 ms against 9 ms).
int pageSizeFor(const Corpus& corpus) {
  double numbers = 0;
  for (const CorpusTake& take : corpus.takes) {
    const double frames = take.labels.duration() * take.motion.frame_rate_hz;  // its motion may lie elsewhere
    numbers += frames * 3 * asReal(corpus.layout.markers.size());
  }
  constexpr double kSmall = 1 << 18;
  return numbers < kSmall ? 4096 : 32768;
}

void writeDescription(SqliteDatabase& database, const Corpus& corpus) {
  CheckedInsert meta = inserter(database, "meta");
  std::int64_t id = 0;
  meta.integer(id++).text("takes").text(fmt::to_string(corpus.takes.size())).insert();
  for (const auto& [key, value] : corpus.build_log) meta.integer(id++).text("log:" + key).text(value).insert();

  inserter(database, "layout").integer(0).text(layoutToJson(corpus.layout)).insert();

  CheckedInsert pose = inserter(database, "neutral_pose");
  for (std::size_t i = 0; i < corpus.layout.markers.size(); ++i) {
    const auto row = corpus.neutral_pose_mm.row(signedIndex(i));
    pose.integer(i).text(corpus.layout.markers[i].name).real(row[0]).real(row[1]).real(row[2]).insert();
  }
}

/// What the samples of a take came to.
struct WrittenSamples {
  std::size_t frames = 0;
  std::size_t samples = 0;
};

void writeTakes(SqliteDatabase& database, const Corpus& corpus, const std::vector<WrittenSamples>& written) {
  CheckedInsert rows = inserter(database, "takes");
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    const CorpusTake& take = corpus.takes[i];
    rows.integer(i).text(take.name).text(take.text).integer(take.labels.phones.size());
    rows.integer(take.labels.syllables.size()).integer(take.labels.words.size());
    rows.integer(written[i].frames).real(take.motion.frame_rate_hz);
    rows.integer(written[i].samples).integer(take.audio.sample_rate_hz).insert();
  }
}

void writeLabels(SqliteDatabase& database, const Corpus& corpus) {
  CheckedInsert words = inserter(database, "words");
  CheckedInsert syllables = inserter(database, "syllables");
  CheckedInsert phones = inserter(database, "phones");
  std::int64_t word_id = 0, syllable_id = 0, phone_id = 0;
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    const SpeechLabels& labels = corpus.takes[i].labels;
    for (const LabelledWord& word : labels.words) {
      words.integer(word_id++).integer(i).text(word.text).integer(word.phones.first.value);
      words.integer(word.phones.last.value).insert();
    }
    for (const LabelledSyllable& syllable : labels.syllables) {
      syllables.integer(syllable_id++).integer(i).integer(syllable.phones.first.value);
      syllables.integer(syllable.phones.last.value).integer(syllable.stress).insert();
    }
    for (const LabelledPhone& phone : labels.phones) {
      phones.integer(phone_id++).integer(i).text(phoneName(phone.phone)).real(phone.span.start).real(phone.span.end);
      phones.integerOrNull(phone.word).integerOrNull(phone.syllable).insert();
    }
  }
}

template <typename T>
std::string_view bytesOf(const T* data, std::size_t count) {
  return {reinterpret_cast<const char*>(data), count * sizeof(T)};
}

void expectMarkers(const MotionClip& motion, const Corpus& corpus) {
  MOUTHPIECE_EXPECT(motion.marker_names == corpus.layout.markerNames());
  MOUTHPIECE_EXPECT(motion.positions_mm.cols() == signedIndex(3 * corpus.layout.markers.size()));
}

/// One take at a time where the corpus has a source.
std::vector<WrittenSamples> writeSamples(SqliteDatabase& database, const Corpus& corpus) {
  std::vector<WrittenSamples> written(corpus.takes.size());
  CheckedInsert motion = inserter(database, "motion");
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    const MotionClip clip = motionOf(corpus, TakeIndex(i));
    expectMarkers(clip, corpus);
    const FloatMatrix positions = clip.positions_mm.cast<float>();
    written[i].frames = clip.frameCount();
    const std::optional<std::string> packed = packedPositions(positions);
    motion.integer(i).blob(packed ? *packed : bytesOf(positions.data(), unsignedIndex(positions.size()))).insert();
  }
  CheckedInsert audio = inserter(database, "audio");
  std::vector<std::int16_t> pcm;
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    const AudioClip loaded = corpus.take_source != nullptr ? corpus.take_source->loadAudio(TakeIndex(i)) : AudioClip();
    const std::vector<float>& samples = corpus.take_source != nullptr ? loaded.samples : corpus.takes[i].audio.samples;
    pcm.resize(samples.size());
    std::transform(samples.begin(), samples.end(), pcm.begin(), [](float sample) {
      return static_cast<std::int16_t>(std::lrint(std::clamp(32768.0F * sample, -32768.0F, 32767.0F)));
    });
    written[i].samples = samples.size();
    const std::optional<std::string> packed = packedSamples(pcm);
    audio.integer(i).blob(packed ? *packed : bytesOf(pcm.data(), pcm.size())).insert();
  }
  return written;
}

void expectWritable(const Corpus& corpus) {
  MOUTHPIECE_EXPECT(corpus.neutral_pose_mm.rows() == signedIndex(corpus.layout.markers.size()));
  MOUTHPIECE_EXPECT(corpus.neutral_pose_mm.allFinite());
  for (const CorpusTake& take : corpus.takes) expectConsistent(take.labels);
}

}  // namespace

void writeCorpus(const std::filesystem::path& path, const Corpus& corpus) {
  expectWritable(corpus);
  writeFileAtomically(path, [&](const std::filesystem::path& temporary) {
    SqliteDatabase database = SqliteDatabase::create(temporary, path);
    // The file is new and renamed only when whole: a journal would protect nothing.
    database.execute(fmt::format("PRAGMA page_size={}; PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; BEGIN",
                                 pageSizeFor(corpus)));
    database.execute(
        fmt::format("PRAGMA application_id={}; PRAGMA user_version={}", kCorpusApplicationId, kCorpusFormatVersion));
    for (const CorpusTable& table : kCorpusTables) database.execute(std::string(table.sql));
    writeDescription(database, corpus);
    writeLabels(database, corpus);
    writeTakes(database, corpus, writeSamples(database, corpus));
    writeTrajectoryModel(database, corpus);
    if (!corpus.viseme_poses.empty()) inserter(database, "viseme_poses").integer(0).text(corpus.viseme_poses).insert();
    writeColumns(inserter(database, "phone_columns"), corpus);
    database.execute("COMMIT");
    database.close();
  });
}

}  // namespace mouthpiece
