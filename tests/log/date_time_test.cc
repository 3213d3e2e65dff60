// Dates and times of day as text.
#include <gtest/gtest.h>

#include "problems/log/units.h"

namespace trueline {
namespace {

TimeNs DateOf(const char* text) {
  TimeNs time = -1;
  return ParseDateTime(text, &time) ? time : -1;
}

TEST(DateTime, IsCountedFrom1970) {
  EXPECT_EQ(DateOf("1970-01-02T00:00:01Z"), 86401 * kNsPerSecond);
  EXPECT_EQ(DateOf("2024-05-01T23:59:55.010000"), 1'714'607'995'010'000'000);
  EXPECT_EQ(DateOf("\"2024-05-01 23:59:55.01Z\""), 1'714'607'995'010'000'000);
  EXPECT_EQ(DateOf("2024-05-02T01:59:55,010000000+02:00"), 1'714'607'995'010'000'000);
  EXPECT_EQ(DateOf("2024-05-01T18:29:55.01-0530"), 1'714'607'995'010'000'000);
}

TEST(DateTime, OfADayIsCountedFromMidnight) {
  EXPECT_EQ(DateOf("00:01:02.5"), 62'500'000'000);
  EXPECT_EQ(DateOf("23:59:59"), 86399 * kNsPerSecond);
}

TEST(DateTime, DatesAndDurationsOfOtherWriters) {
  const TimeNs at = DateOf("2024-05-20T13:00:00.01");
  EXPECT_EQ(DateOf("05/20/2024 01:00:00.010 PM"), at);
  EXPECT_EQ(DateOf("20.05.2024 13:00:00,010"), at);
  EXPECT_EQ(DateOf("20.05.2024 12:30:00 AM"), DateOf("2024-05-20T00:30:00"));
  EXPECT_EQ(DateOf("1 days 00:00:00.010000"), 86'400'010'000'000);
  EXPECT_EQ(DateOf("00:50.010"), 50'010'000'000);
}

TEST(DateTime, OtherTextIsNone) {
  for (const char* text : {"", "12.5", "2024-05-01", "2024-13-01T00:00:00Z", "23:59", "1:02:03",
                           "2024-05-01T23:59:55X", "23:59:59 h"}) {
    EXPECT_EQ(DateOf(text), -1) << text;
  }
}

}  // namespace
}  // namespace trueline
