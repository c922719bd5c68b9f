// Files and folders that are whole or not there, whoever waits for them.
#include "base/files.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <set>
#include <thread>

#include "base/child_process.h"
#include "base/file_parts.h"
#include "base/unfinished.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

std::set<std::string> namesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

void age(const fs::path& path) { fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(1)); }

TEST(Files, ATemporaryIsNewAndItsNameNotToBeForeseen) {
  const PrivateFolder folder;
  std::set<std::string> names;
  for (int i = 0; i < 20; ++i) {
    writeFileAtomically(folder.path() / "a.txt", [&](const fs::path& temporary) {
      struct stat facts {};
      ASSERT_EQ(::lstat(temporary.c_str(), &facts), 0);
      EXPECT_TRUE(S_ISREG(facts.st_mode));
      EXPECT_EQ(temporary.parent_path(), folder.path());
      // Whole: a short number may stand in any.
      EXPECT_EQ(temporary.filename().string().find("." + std::to_string(::getpid()) + "."), std::string::npos);
      names.insert(temporary.filename().string());
      std::ofstream(temporary) << i;
    });
  }
  EXPECT_EQ(names.size(), 20U);
  EXPECT_EQ(readFile(folder.path() / "a.txt"), "19");
  EXPECT_EQ(namesIn(folder.path()), std::set<std::string>{"a.txt"});
}

/// Between the making of a file and the noting of it the process may end: whoever ends it waits until both are done.
TEST(FilesDeathTest, NoneIsThereThatIsNotNoted) {
  const fs::path path = fs::path(::testing::TempDir()) / ("mouthpiece_begun_" + std::to_string(::getpid()));
  EXPECT_EXIT(
      {
        std::atomic<bool> is_made = false;
        std::thread maker([&] {
          const Unfinished begun([&] {
            std::ofstream(path) << "begun";
            is_made = true;
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
            return path;
          });
          std::this_thread::sleep_for(std::chrono::seconds(60));
        });
        while (!is_made) std::this_thread::yield();
        endUnfinished();
        std::_Exit(3);
      },
      ::testing::ExitedWithCode(3), "");
  EXPECT_FALSE(fs::exists(path));
  fs::remove(path);
}

TEST(Files, APlantedLinkIsNotFollowed) {
  const PrivateFolder folder;
  writeFileAtomically(folder.path() / "precious", std::string_view("kept"));
  // Where earlier versions wrote.
  fs::create_symlink(folder.path() / "precious", folder.path() / (".a.txt." + std::to_string(::getpid()) + ".tmp"));
  writeFileAtomically(folder.path() / "a.txt", std::string_view("new"));
  EXPECT_EQ(readFile(folder.path() / "precious"), "kept");
  EXPECT_EQ(readFile(folder.path() / "a.txt"), "new");
}

/// As root a file in its place would leave a machine without /dev/null.
TEST(Files, APipeOrADeviceIsNoFileToWrite) {
  const PrivateFolder folder;
  const fs::path pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(errorOf([&] { writeFileAtomically(pipe, std::string_view("x")); }),
            pipe.string() + ": is no regular file; expected a file name");
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_EQ(namesIn(folder.path()), std::set<std::string>{"pipe"});
}

TEST(Files, KeepsTheUsersMask) {
  const PrivateFolder folder;
  const mode_t before = ::umask(027);
  writeFileAtomically(folder.path() / "a.txt", std::string_view("x"));
  ::umask(before);
  EXPECT_EQ(fs::status(folder.path() / "a.txt").permissions(), fs::perms(0640));
}

TEST(Files, KeepWhoMayReadThem) {
  const PrivateFolder folder;
  const fs::path file = folder.path() / "a.txt";
  writeFileAtomically(file, std::string_view("a"));
  for (const mode_t mode : {0600U, 0664U, 0755U}) {
    ASSERT_EQ(::chmod(file.c_str(), mode), 0);
    writeFileAtomically(file, std::string_view("b"));
    struct stat facts {};
    ASSERT_EQ(::stat(file.c_str(), &facts), 0);
    EXPECT_EQ(facts.st_mode & 07777U, mode);
  }
}

TEST(Files, ThatMayNotBeWrittenAreKept) {
  const PrivateFolder folder;
  const fs::path file = folder.path() / "a.txt";
  writeFileAtomically(file, std::string_view("mine"));
  ASSERT_EQ(::chmod(file.c_str(), 0444), 0);
  EXPECT_EQ(errorOf([&] { writeFileAtomically(file, std::string_view("b")); }),
            file.string() + ": is write-protected; expected a file to write");
  EXPECT_EQ(readFile(file), "mine");
  EXPECT_EQ(namesIn(folder.path()).size(), 1U);
}

/// Anybody may have planted it where others write, too.
TEST(Files, ReplaceALinkAndNotWhatItLeadsTo) {
  const PrivateFolder folder;
  const fs::path target = folder.path() / "target.txt", link = folder.path() / "a.txt";
  writeFileAtomically(target, std::string_view("kept"));
  ASSERT_EQ(::chmod(target.c_str(), 0444), 0);
  fs::create_symlink("target.txt", link);
  writeFileAtomically(link, std::string_view("new"));
  EXPECT_FALSE(fs::is_symlink(link));
  EXPECT_EQ(readFile(target) + readFile(link), "keptnew");
}

TEST(Files, WhatAKilledProcessLeftGoesAndWhatOthersAreAtStays) {
  const PrivateFolder folder;
  const fs::path left = folder.path() / ".a.txt.0123012301230123.tmp",
                 held = folder.path() / ".a.txt.4567456745674567.tmp",
                 young = folder.path() / ".a.txt.89ab89ab89ab89ab.tmp",
                 empty = folder.path() / ".a.txt.cdefcdefcdefcdef.tmp",
                 other = folder.path() / ".b.txt.cdefcdefcdefcdef.tmp";
  for (const fs::path& path : {left, held, young, other}) std::ofstream(path) << "x";
  std::ofstream{empty};  // its maker may not have locked it yet
  for (const fs::path& path : {left, other}) age(path);
  const FileLock lock(::open(held.c_str(), O_RDONLY | O_CLOEXEC));
  ASSERT_TRUE(lock.isOurs());
  writeFileAtomically(folder.path() / "a.txt", std::string_view("new"));
  EXPECT_EQ(namesIn(folder.path()),
            (std::set<std::string>{"a.txt", held.filename(), empty.filename(), other.filename()}));
}

TEST(Files, AFolderLeftInTheTemporaryFolderGoes) {
  const PrivateFolder base;
  const char* before = std::getenv("TMPDIR");
  const std::string old = before == nullptr ? "" : before;
  ::setenv("TMPDIR", base.path().c_str(), 1);
  const fs::path left = base.path() / "mouthpiece.Ab12Cd", mine = base.path() / "mouthpieces";
  for (const fs::path& path : {left / "deep", mine}) fs::create_directories(path);
  fs::permissions(left, fs::perms::owner_all);  // as mkdtemp makes them
  age(left);
  age(mine);
  {
    const PrivateFolder folder;
    EXPECT_FALSE(fs::exists(left));
    EXPECT_TRUE(fs::exists(mine));
    EXPECT_EQ(folder.path().parent_path(), base.path());
    const FileLock second(::open(folder.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    EXPECT_FALSE(second.isOurs()) << "another process would take the folder for a leftover";
  }
  old.empty() ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", old.c_str(), 1);
}

/// Only what a process of ours may have left is swept: of the user's files and folders none.
TEST(Leftovers, AreNoFilesOfTheUsers) {
  const PrivateFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder.path() / name) << text;
    return folder.path() / name;
  };
  const auto old = [](const fs::path& path) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(1));
  };
  const std::vector<std::string> kept{"mouthpiece.glb", "mouthpiece.notes.txt", ".a.csv.notes.tmp",
                                      ".a.csv.0123456789ABCDEF.tmp", ".a.csv..tmp"};
  for (const std::string& name : kept) old(write(name, "mine"));
  const fs::path open = folder.path() / "mouthpiece.backup", shut = folder.path() / "mouthpiece.a1B2c3",
                 other = folder.path() / "mouthpiece.project", file = write(".a.csv.0123456789abcdef.tmp", "");
  for (const fs::path& each : {open, shut, other}) fs::create_directories(each);
  fs::permissions(shut, fs::perms::owner_all);
  fs::permissions(other, fs::perms::owner_all);
  for (const fs::path& each : {open, shut, other, file}) old(each);
  sweepLeftovers(folder.path(), "mouthpiece.", "", LeftoverKind::kFolder);
  sweepLeftovers(folder.path(), ".a.csv.", ".tmp", LeftoverKind::kFile);
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(folder.path() / name)) << name;
  EXPECT_TRUE(fs::exists(open)) << "others may look into it: no temporary of ours";
  EXPECT_TRUE(fs::exists(other));
  EXPECT_FALSE(fs::exists(shut));
  EXPECT_FALSE(fs::exists(file));
}

TEST(FilesTogether, AppearAtCommitInTheOrderOfWriting) {
  const PrivateFolder folder;
  writeFileAtomically(folder.path() / "a", std::string_view("old"));
  {
    FilesTogether lost;
    writeFileAtomically(folder.path() / "a", std::string_view("new"));
    writeFileAtomically(folder.path() / "deep" / "b", std::string_view("new"));
    EXPECT_EQ(readFile(folder.path() / "a"), "old");
    EXPECT_FALSE(fs::exists(folder.path() / "deep" / "b"));
  }
  EXPECT_EQ(readFile(folder.path() / "a"), "old");
  EXPECT_TRUE(namesIn(folder.path() / "deep").empty());
  FilesTogether kept;
  writeFileAtomically(folder.path() / "a", std::string_view("new"));
  {
    FilesTogether inner;
    writeFileAtomically(folder.path() / "c", std::string_view("new"));
    inner.commit();
    EXPECT_FALSE(fs::exists(folder.path() / "c"));
  }
  kept.commit();
  EXPECT_EQ(readFile(folder.path() / "a"), "new");
  EXPECT_EQ(namesIn(folder.path()), (std::set<std::string>{"a", "c", "deep"}));
}

TEST(FilesTogether, ThreadsThatJoinWriteIntoIt) {
  const PrivateFolder folder;
  FilesTogether set;
  std::thread other([&] {
    const FilesTogether::Joined joined(set);
    writeFileAtomically(folder.path() / "a.txt", "joined");
  });
  other.join();
  EXPECT_FALSE(fs::exists(folder.path() / "a.txt"));
  std::thread stranger([&] { writeFileAtomically(folder.path() / "b.txt", "of no set"); });
  stranger.join();
  EXPECT_EQ(readFile(folder.path() / "b.txt"), "of no set");
  set.commit();
  EXPECT_EQ(readFile(folder.path() / "a.txt"), "joined");
}

TEST(FileReader, ReadsFromAnyPlaceAndSaysWhatThereIs) {
  const PrivateFolder folder;
  writeFileAtomically(folder.path() / "a.txt", "0123456789");
  const FileReader file(folder.path() / "a.txt");
  EXPECT_EQ(file.size(), 10U);
  std::string bytes(4, '?');
  EXPECT_EQ(file.read(3, bytes), 4U);
  EXPECT_EQ(bytes, "3456");
  EXPECT_EQ(file.read(8, bytes), 2U);
  EXPECT_EQ(bytes.substr(0, 2), "89");
  EXPECT_EQ(file.read(10, bytes), 0U);
  EXPECT_EQ(file.read(std::uint64_t{1} << 40, bytes), 0U);
  EXPECT_NE(errorOf([&] { FileReader(folder.path() / "none"); }).find("no such file"), std::string::npos);
  EXPECT_NE(errorOf([&] { FileReader{folder.path()}; }).find("is no regular file"), std::string::npos);
  EXPECT_NE(errorOf([&] { FileReader(folder.path() / "a.txt", 9); }).find("is 10 bytes long; expected at most 9"),
            std::string::npos);
}

TEST(FilesTogether, OneThatCannotTakeItsNameGivesTheOthersTheirsBack) {
  const PrivateFolder folder;
  writeFileAtomically(folder.path() / "a", std::string_view("old"));
  FilesTogether set;
  for (const char* name : {"a", "new", "b"}) writeFileAtomically(folder.path() / name, std::string_view("new"));
  fs::create_directories(folder.path() / "b" / "in_the_way");  // come while the set was written
  const std::string error = errorOf([&] { set.commit(); });
  EXPECT_NE(error.find("b: cannot be written"), std::string::npos) << error;
  EXPECT_EQ(readFile(folder.path() / "a"), "old");
  EXPECT_FALSE(fs::exists(folder.path() / "new"));
}

TEST(FilesTogether, OneThatCannotBeWrittenLeavesTheOthersAsTheyWere) {
  const PrivateFolder folder;
  writeFileAtomically(folder.path() / "a", std::string_view("old"));
  const std::string error = errorOf([&] {
    FilesTogether set;
    writeFileAtomically(folder.path() / "a", std::string_view("new"));
    writeFileAtomically(folder.path() / "a" / "b", std::string_view("new"));
    set.commit();
  });
  EXPECT_NE(error.find("a: cannot be made"), std::string::npos) << error;
  EXPECT_EQ(readFile(folder.path() / "a"), "old");
  EXPECT_EQ(namesIn(folder.path()), std::set<std::string>{"a"});
}

}  // namespace
}  // namespace mouthpiece
