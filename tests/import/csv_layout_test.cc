// What the first lines of a CSV file of unknown origin show.
#include <fmt/format.h>

#include "problems/import/channel_row.h"
#include "problems/import/find_map.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "tests/import/import_files.h"

namespace trueline {
namespace {

class CsvLayoutOf : public testing::Test {
 protected:
  CsvLayout Guess(const std::string& text) { return GuessCsvLayout(files_.Write("log.csv", text)); }
  std::string List(const std::string& text) {
    return ListChannels(*OpenRecording(files_.Write("log.csv", text)));
  }
  ImportFiles files_;
};

TEST_F(CsvLayoutOf, BlanksInNamesDoNotSeparate) {
  const CsvLayout layout = Guess("t,acc x,acc y,acc z,ang vel x\n0.0,1,2,3,4\n0.1,1,2,3,4\n");
  EXPECT_EQ(layout.separators.delimiter, ',');
  ASSERT_EQ(layout.columns.size(), 5U);
  EXPECT_EQ(layout.columns[1], "acc x");
  EXPECT_EQ(Guess("t a b\n0 1 2\n1 1 2\n").separators.delimiter, ' ');
  EXPECT_EQ(Guess("t;a;b\n0;1,5;2\n1;1,5;2\n").separators.delimiter, ';');
  EXPECT_FALSE(Guess("t;a;b\n0;1.5;2\n1;1.5;2\n").separators.decimal_comma);
  // More commas than semicolons, with names and without.
  for (const char* text : {"t;a\n0,1;1,5\n0,2;1,5\n", "0,1;1,5\n0,2;1,5\n"}) {
    EXPECT_EQ(Guess(text).separators.delimiter, ';') << text;
    EXPECT_TRUE(Guess(text).separators.decimal_comma) << text;
    EXPECT_EQ(Guess(text).columns.size(), 2U) << text;
  }
}

TEST_F(CsvLayoutOf, CommasMayBeDecimalBesideText) {
  const CsvLayout layout = Guess("t;x;y;mode\n0,10;1,5;2,5;STAB\n0,11;1,5;2,5;STAB\n");
  EXPECT_EQ(layout.separators, (CsvSeparators{';', true}));
  EXPECT_EQ(layout.columns.size(), 4U);
  EXPECT_EQ(layout.time->column, 0U);
  EXPECT_EQ(Guess("t,x,note\n0.1,2,a;b\n0.2,3,c;d\n").separators, (CsvSeparators{',', false}));
}

// As data frames are written: the rows' numbers have no name.
TEST_F(CsvLayoutOf, ANamelessColumnIsNoSignOfRows) {
  for (const char* text : {";t;x\n0;0,1;1,5\n1;0,2;1,5\n2;0,3;1,5\n3;0,4;1,5\n",
                           ";t;x\n0;0.1;1.5\n1;0.2;1.5\n2;0.3;1.5\n3;0.4;1.5\n"}) {
    EXPECT_EQ(Guess(text).columns, (std::vector<std::string>{"1", "t", "x"})) << text;
  }
}

TEST_F(CsvLayoutOf, WithoutAHeaderColumnsAreNumbers) {
  const CsvLayout layout = Guess("0,0.1,7\n1,0.2,8\n");
  EXPECT_FALSE(layout.header);
  EXPECT_EQ(layout.columns, (std::vector<std::string>{"1", "2", "3"}));
  EXPECT_FALSE(layout.time);
  EXPECT_THAT(List("0,0.1,7\n1,0.2,8\n"), HasSubstr("rows                                        2"
                                                    "          -"));
}

TEST_F(CsvLayoutOf, ARowMayHoldText) {
  const CsvLayout layout = Guess("0.1234567890123,ARMED,2.5\n0.2,ARMED,2.5\n0.3,ARMED,2.5\n");
  EXPECT_FALSE(layout.header);
  EXPECT_THAT(List("0.1234567890123,ARMED,2.5\n0.2,ARMED,2.5\n0.3,ARMED,2.5\n"), HasSubstr("3"));
  EXPECT_TRUE(Guess("t,0,1\n0.1,2,3\n0.2,2,3\n").header);
}

TEST_F(CsvLayoutOf, ALineOfTypesIsNoRow) {
  const CsvLayout layout = Guess("t,a\nfloat64,float64\n0.1,2\n0.2,2\n");
  EXPECT_TRUE(layout.units_line);
  EXPECT_EQ(layout.time->column, 0U);
}

// Motive's head, and that of a table of pandas with columns of two levels.
TEST_F(CsvLayoutOf, LinesAboveTellNamesApart) {
  const CsvLayout motive = Guess(
      "Format,1.23,Rate,100\n\n,,Body,Body,Body,Body\n,,\"1\",\"1\",\"1\",\"1\"\n"
      ",,Rotation,Rotation,Position,Position\nFrame,Time (Seconds),X,Y,X,Y\n"
      "0,0.00,1,2,3,4\n1,0.01,1,2,3,4\n2,0.02,1,2,3,4\n3,0.03,1,2,3,4\n4,0.04,1,2,3,4\n"
      "5,0.05,1,2,3,4\n6,0.06,1,2,3,4\n");
  EXPECT_EQ(motive.columns, (std::vector<std::string>{"Frame", "Time (Seconds)", "Rotation.X",
                                                      "Rotation.Y", "Position.X", "Position.Y"}));
  ASSERT_TRUE(motive.time);
  EXPECT_EQ(motive.time->column, 1U);
  EXPECT_EQ(motive.time->exponent, 9);
  EXPECT_EQ(motive.LinesBeforeRows(), 6);
  const CsvLayout pandas =
      Guess("t,acc,acc,gyro\n,x,y,x\n0.1,1,2,3\n0.2,1,2,3\n0.3,1,2,3\n0.4,1,2,3\n");
  EXPECT_EQ(pandas.columns, (std::vector<std::string>{"t", "acc.x", "acc.y", "gyro.x"}));
  EXPECT_EQ(Guess("# t x\n0.1 2\n0.2 2\n0.3 2\n").columns, (std::vector<std::string>{"t", "x"}));
}

TEST_F(CsvLayoutOf, SaysWhyATimeIsNone) {
  const CsvLayout date = Guess("time,n\nlast May,1\nlast May,2\nlast May,4\n");
  EXPECT_FALSE(date.time);
  EXPECT_THAT(date.time_problem, HasSubstr("column 'time' reads 'last May'"));
  const CsvLayout lost = Guess("time,a\n1.77e9,1\n1.77e9,2\n1.77e9,4\n1.77e9,3\n");
  EXPECT_THAT(lost.time_problem, HasSubstr("does not rise"));
  EXPECT_THAT(Guess("t [min],a\n0.1,1\n0.2,1\n0.3,1\n").time_problem, HasSubstr("unit of time"));
  EXPECT_FALSE(Guess("frame,a\n7,1\n8,1\n9,1\n10,1\n").time);
  // A comment among many rows does not spoil the column.
  std::string rows = "t,a\n";
  for (int i = 0; i < 200; ++i)
    rows += fmt::format("{}\n", i == 99 ? "# lost" : fmt::format("{},1", 0.01 * i));
  EXPECT_TRUE(Guess(rows).time);
}

TEST_F(CsvLayoutOf, NamesThatFitNoColumnsAreNotUsed) {
  const CsvLayout layout = Guess("time,a\n1,2,3\n2,2,3\n");
  EXPECT_THAT(layout.warning, HasSubstr("names 2 columns where the rows have 3"));
  EXPECT_EQ(layout.columns.front(), "1");
  EXPECT_FALSE(layout.time);
}

// "# t,x" before numbers has names; a comment is followed by names or by another comment.
TEST_F(CsvLayoutOf, CommentsBeforeTheNamesAreSkipped) {
  const std::string text = "# flight 7\n# wind, none\n\nt,a\n1,2\n2,3\n";
  const CsvLayout layout = Guess(text);
  EXPECT_EQ(layout.skip_lines, 3);
  EXPECT_EQ(layout.columns, (std::vector<std::string>{"t", "a"}));
  EXPECT_EQ(layout.time->column, 0U);
  EXPECT_THAT(List(text), HasSubstr("rows                                        2"));
  EXPECT_THAT(ProposeMap(OpenRecording(files_.Write("log.csv", text)).get()),
              HasSubstr(", skip_lines: 3, time: {column: \"t\""));
  const CsvLayout names = Guess("# flight 7\n# t,a\n1,2\n2,3\n");
  EXPECT_EQ(names.skip_lines, 1);
  EXPECT_EQ(names.columns, (std::vector<std::string>{"# t", "a"}));
  EXPECT_EQ(names.time->column, 0U);
}

TEST_F(CsvLayoutOf, FindsTheTimeAndItsUnit) {
  EXPECT_EQ(Guess("thrust,theta,t\n3,2,0.00\n2,1,0.01\n5,4,0.02\n").time->column, 2U);
  const CsvLayout falls = Guess("t,time_left\n5,3\n4,2\n3,1\n");
  EXPECT_FALSE(falls.time);
  const auto exponent = [&](const char* name, const char* a, const char* b) {
    return Guess(fmt::format("{},x\n{},1\n{},1\n{}9,1\n", name, a, b, b)).time->exponent;
  };
  EXPECT_EQ(exponent("time (us)", "1", "2"), 3);
  EXPECT_EQ(exponent("#timestamp [ns]", "1", "2"), 0);
  EXPECT_EQ(exponent("timestamp", "1403715273262142976", "1403715273267142912"), 0);
  EXPECT_EQ(exponent("timestamp", "1403715273262142", "1403715273267142"), 3);
  EXPECT_EQ(exponent("timestamp", "1403715273262", "1403715273267"), 6);
  EXPECT_EQ(exponent("t", "1772429364.81", "1772429364.82"), 9);
  // A clock since the computer's start has the size of another unit's since 1970.
  EXPECT_EQ(exponent("timestamp", "5000000000000", "5000010000000"), 0);
  EXPECT_EQ(exponent("timestamp", "5000000000000", "5000000010000"), 3);
}

TEST_F(CsvLayoutOf, DatesAndTimesOfDayAreTimes) {
  for (const char* day : {"", "2024-05-01T", "2024-05-01 "}) {
    const std::string text =
        fmt::format("a,time\n1,{0}23:59:55.25\n1,{0}23:59:55.26\n1,{0}23:59:55.27\n", day);
    EXPECT_EQ(Guess(text).time->column, 1U);
    const std::string map =
        "inputs: {log: {time: {column: time}}}\n"
        "streams: {imu: {accel: {columns: [a, a, a]}, gyro: {columns: [a, a, a]}}}\n";
    const FlightLog log = files_.Convert(map, text);
    ASSERT_EQ(log.imu.size(), 3U);
    EXPECT_EQ(log.imu[2].t - log.imu[0].t, 20'000'000);
    EXPECT_EQ(log.imu[0].t % (86400 * kNsPerSecond), 86395 * kNsPerSecond + 250'000'000);
  }
}

// The header alone tells that a shipped map fits; a map of numbers fits no file by its header.
TEST_F(CsvLayoutOf, AShippedMapIsFoundByItsNames) {
  const std::string header =
      "t,ang acc x,ang acc y,ang acc z,ang vel x,ang vel y,ang vel z,quat x,quat y,quat z,quat w,"
      "acc x,acc y,acc z,vel x,vel y,vel z,pos x,pos y,pos z,mot 1,mot 2,mot 3,mot 4,vbat\n";
  std::string row = "0.1";
  for (int i = 0; i < 24; ++i) row += ",0";
  const auto map = FindShippedMap(*OpenRecording(files_.Write("a.csv", header + row + "\n")));
  ASSERT_TRUE(map);
  EXPECT_THAT(map->file, HasSubstr("neurobem.yaml"));
  std::string wide = "time,a\n";
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 56; ++i) wide += fmt::format("{}{}", i > 0 ? "," : "", k);
    wide += "\n";
  }
  EXPECT_FALSE(FindShippedMap(*OpenRecording(files_.Write("b.csv", wide))));
  EXPECT_FALSE(FindShippedMap(*OpenRecording(files_.Write("c.csv", "t,a\n1,2\n2,3\n"))));
}

TEST_F(CsvLayoutOf, OtherEncodingsAreRefusedWithARemedy) {
  const auto refusal = [&](const std::string& text) {
    return trueline::ErrorOf([&] { OpenRecording(files_.Write("log.csv", text)); });
  };
  EXPECT_THAT(refusal({"\xFF\xFEt\0,\0a\0\n\0", 10}), HasSubstr("log.csv:1: is UTF-16 text"));
  EXPECT_THAT(refusal("t,a\r1,2\r2,3\r"), HasSubstr("log.csv:1: has lines that end in CR alone"));
}

TEST_F(CsvLayoutOf, SaysWhatIsMissing) {
  const auto why = [&](const std::string& text) {
    return WhyNoMapFits(OpenRecording(files_.Write("log", text)).get());
  };
  EXPECT_THAT(why("t,a\n1,2\n2,3\n"), HasSubstr("has no accelerometer and gyroscope"));
  EXPECT_THAT(why("t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n1,2,3,4,5,6,7\n"),
              HasSubstr("no map in config/import fits it, though"));
  EXPECT_THAT(why("1.0 1 2 3 0 0 0 1\n1.1 1 2 3 0 0 0 1\n"), HasSubstr("is a trajectory"));
  EXPECT_EQ(why("t,a\n"), "has no records");
}

}  // namespace
}  // namespace trueline
