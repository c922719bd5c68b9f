// Events of C3D files: the EVENT group and the header's old list, in files made by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "c3d_by_hand.h"
#include "motion/formats/c3d_file.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

constexpr double kFloatTime = 1e-5;  ///< a minute as float, s

std::vector<MotionEvent> eventsOf(const C3dByHand& file) { return readC3dEventsBytes(file.bytes(), "by_hand.c3d"); }

void expectEvent(const MotionEvent& event, const std::string& label, const std::string& context, double time) {
  EXPECT_EQ(event.label, label);
  EXPECT_EQ(event.context, context);
  EXPECT_NEAR(event.time, time, kFloatTime);
}

class C3dEvents : public testing::TestWithParam<int> {
 protected:
  static C3dByHand file() {
    C3dByHand made;
    made.processor = GetParam();
    return made;
  }
};
INSTANTIATE_TEST_SUITE_P(IntelDecMips, C3dEvents, testing::Values(84, 85, 86));

TEST_P(C3dEvents, OfTheGroupComeInMinutesAndSeconds) {
  C3dByHand made = file();
  made.group_events = {{"Left", "Foot Strike", 0, 0.04F}, {"General", "Clap", 2, 3.5F}};
  const auto events = eventsOf(made);
  ASSERT_EQ(events.size(), 2U);
  expectEvent(events[0], "Foot Strike", "Left", 0.04);
  expectEvent(events[1], "Clap", "General", 123.5);
  EXPECT_EQ(readC3dBytes(made.bytes(), "by_hand.c3d").frameCount(), 3U) << "the points stay as they are";
}

TEST_P(C3dEvents, OfTheHeaderAreReadWhereThereIsNoGroup) {
  C3dByHand made = file();
  made.header_events = {{"", "CLAP", 0, 0.25F}, {"", "GO", 0, 1.5F}};
  auto events = eventsOf(made);
  ASSERT_EQ(events.size(), 2U);
  expectEvent(events[0], "CLAP", "", 0.25);
  expectEvent(events[1], "GO", "", 1.5);
  made.group_events = {{"Right", "Foot Off", 0, 1.0F}};
  events = eventsOf(made);
  ASSERT_EQ(events.size(), 1U);
  expectEvent(events[0], "Foot Off", "Right", 1.0);
}

TEST_P(C3dEvents, CountFromTheFirstFrameThatTheFileHolds) {
  C3dByHand made = file();
  made.first_frame = 101;  // 2 s into the trial at 50 Hz
  made.last_frame = 103;
  made.group_events = {{"", "Clap", 0, 2.5F}, {"", "Before", 0, 1.0F}};
  const auto events = eventsOf(made);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, 0.5, kFloatTime);
  EXPECT_NEAR(events[1].time, -1.0, kFloatTime);
}

TEST_P(C3dEvents, ALateStartStandsInTrial) {
  C3dByHand made = file();
  made.trial_start = 65536 + 101;
  made.trial_end = 65536 + 103;
  made.first_frame = 101;
  made.last_frame = 103;
  made.group_events = {{"", "Clap", 22, 0.0F}};
  EXPECT_NEAR(eventsOf(made).at(0).time, 22 * 60 - (65536 + 100) / 50.0, kFloatTime);
}

TEST(C3dEventsOf, AFileWithoutEventsHasNone) { EXPECT_TRUE(eventsOf(C3dByHand{}).empty()); }

TEST(C3dEventsOf, FewerAreUsedThanListed) {
  C3dByHand made;
  made.group_events = {{"", "A", 0, 1.0F}, {"", "B", 0, 2.0F}};
  made.events_used = 1;
  EXPECT_EQ(eventsOf(made).size(), 1U);
  made.events_used = 9;  // more than there are times
  EXPECT_EQ(eventsOf(made).size(), 2U);
}

TEST(C3dEventsOf, ATimeThatIsNoNumberIsRefused) {
  for (const float bad : {std::nanf(""), INFINITY, 1e12F}) {
    C3dByHand made;
    made.group_events = {{"", "A", 0, bad}};
    EXPECT_THROW(eventsOf(made), InputError) << bad;
    made.group_events.clear();
    made.header_events = {{"", "A", 0, bad}};
    EXPECT_THROW(eventsOf(made), InputError) << bad;
  }
}

TEST(C3dEventsOf, MoreThanTheHeaderHoldsIsRefused) {
  C3dByHand made;
  made.header_events = {{"", "A", 0, 1.0F}};
  std::string bytes = made.bytes();
  bytes[300] = 19;
  EXPECT_THROW(readC3dEventsBytes(bytes, "by_hand.c3d"), InputError);
}

TEST(C3dEventsOf, WrittenOnesAreReadAgainAndChangeNoPoint) {
  const MotionClip clip = readC3dBytes(C3dByHand{}.bytes(), "by_hand.c3d");
  std::vector<MotionEvent> events;
  for (int i = 0; i < 300; ++i)  // more than one parameter holds
    events.push_back({i % 2 == 0 ? "slate" : "", i % 3 == 0 ? "General" : "", 0.37 * i - 2});
  events.push_back({"almost a minute", "", 59.99999999});
  const std::string once = writeC3dBytes(clip, events);
  const auto read = readC3dEventsBytes(once, "once.c3d");
  ASSERT_EQ(read.size(), events.size());
  for (std::size_t i = 0; i < events.size(); ++i)
    expectEvent(read[i], events[i].label, events[i].context, events[i].time);
  EXPECT_EQ(writeC3dBytes(readC3dBytes(once, "once.c3d"), read), once);
  EXPECT_EQ(readC3dBytes(once, "once.c3d").positions_mm, clip.positions_mm);
  EXPECT_THROW(writeC3dBytes(clip, {{std::string(200, 'x'), "", 0}}), InputError);
}

}  // namespace
}  // namespace mouthpiece
