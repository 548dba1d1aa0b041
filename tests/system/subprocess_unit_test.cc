#include "experiments/system/subprocess.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "sim/base/check.h"

namespace turbidock::system {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// The message of the SimulatorFault that `action` must end with.
std::string FaultOf(auto&& action) {
  try {
    action();
  } catch (const SimulatorFault& fault) {
    return fault.what();
  }
  return "no fault";
}

TEST(Subprocess, HandsOverInputAndReturnsOutput) {
  Subprocess cat({"cat"}, "coreutils");
  EXPECT_TRUE(cat.Write("one ", 4));
  EXPECT_TRUE(cat.Write("two", 3));
  EXPECT_EQ(cat.Finish(), "one two");
}

TEST(Subprocess, ArgumentsAreNotReadByAShell) {
  Subprocess echo({"printf", "%s|", "a b", "$HOME", "'*'"}, "coreutils");
  EXPECT_EQ(echo.Finish(), "a b|$HOME|'*'|");
}

// Far more than any pipe holds, in both directions at once.
TEST(Subprocess, LargeInputComesBackUnchanged) {
  std::string sent(8 << 20, '\0');
  for (size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<char>(i * 2654435761u >> 13);
  Subprocess cat({"cat"}, "coreutils");
  EXPECT_TRUE(cat.Write(sent.data(), sent.size()));
  EXPECT_TRUE(cat.Finish() == sent);
}

TEST(Subprocess, MissingProgramNamesItsPackage) {
  EXPECT_THAT(FaultOf([] { Subprocess({"no-such-program-here"}, "its-package"); }),
              AllOf(HasSubstr("no-such-program-here"), HasSubstr("package its-package")));
}

TEST(Subprocess, FailureTellsStatusAndStandardError) {
  Subprocess failing({"sh", "-c", "echo shown; echo broken glass >&2; exit 3"}, "dash");
  EXPECT_EQ(FaultOf([&] { failing.Finish(); }), "sh ended with exit status 3: broken glass");
}

TEST(Subprocess, LongReportsKeepTheirEnd) {
  Subprocess failing(
      {"sh", "-c", "i=0; while [ $i -lt 2000 ]; do echo $i >&2; i=$((i+1)); done; exit 1"}, "dash");
  const std::string message = FaultOf([&] { failing.Finish(); });
  EXPECT_THAT(message, EndsWith("1998 1999"));
  EXPECT_LT(message.size(), 2100u);
}

TEST(Subprocess, DeathBySignalIsAFailure) {
  Subprocess killed({"sh", "-c", "kill -9 $$"}, "dash");
  EXPECT_EQ(FaultOf([&] { killed.Finish(); }), "sh was killed by signal 9");
}

TEST(Subprocess, ProgramThatStopsReadingIsNotASignal) {
  Subprocess deaf({"sh", "-c", "exec 0<&-; echo enough >&2; exit 4"}, "dash");
  const std::string sent(4 << 20, 'x');
  EXPECT_FALSE(deaf.Write(sent.data(), sent.size()));
  EXPECT_EQ(FaultOf([&] { deaf.Finish(); }), "sh ended with exit status 4: enough");
}

TEST(Subprocess, IsKilledWithItsOwnWhenStopped) {
  const std::string alive = ::testing::TempDir() + "alive";
  Subprocess slow({"sh", "-c", "(sleep 1; touch " + alive + ") & wait"}, "dash");
  int asked = 0;
  EXPECT_EQ(slow.FinishUnless([&] { return ++asked > 2; }), std::nullopt);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_FALSE(std::filesystem::exists(alive));
  Subprocess quick({"echo", "done"}, "coreutils");
  EXPECT_EQ(quick.FinishUnless([] { return false; }), "done\n");
}

// A program that held the other end of an earlier one's input would keep that one waiting for ever.
TEST(Subprocess, LaterProgramsDoNotInheritOurEnds) {
  const std::vector<std::string> list = {"ls", "/proc/self/fd"};
  const std::string alone = Subprocess(list, "coreutils").Finish();
  Subprocess open({"cat"}, "coreutils");
  EXPECT_EQ(Subprocess(list, "coreutils").Finish(), alone);
  EXPECT_GE(std::count(alone.begin(), alone.end(), '\n'), 3);
  open.Finish();
}

TEST(SubprocessDeath, FinishesOnce) {
  Subprocess cat({"cat"}, "coreutils");
  cat.Finish();
  EXPECT_DEATH(cat.Finish(), "finished once");
}

}  // namespace
}  // namespace turbidock::system
