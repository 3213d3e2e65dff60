// Counters that wrap, samples that share a stamp, and files as people pack them.
#include <bzlib.h>
#include <fmt/format.h>
#include <lzma.h>
#include <zlib.h>
#include <zstd.h>

#include "problems/import/stamp_reader.h"
#include "problems/log/unpacked.h"
#include "tests/import/import_files.h"

namespace trueline {
namespace {

constexpr char kStampsMap[] =
    "inputs: {log: {time: {column: t, unit: us}}}\n"
    "streams: {imu: {accel: {columns: [a, a, a]}, gyro: {columns: [a, a, a]}}}\n";

TEST(WrappedClock, UndoesEachCounterAtAnyRate) {
  for (const auto& [period, unit] : {std::pair<TimeNs, TimeNs>{1LL << 32, 1000},
                                     {1LL << 32, 1'000'000},
                                     {1LL << 16, 1'000'000},
                                     {1LL << 16, 1000}}) {
    for (const double rate : {20.0, 250.0, 4000.0}) {
      const TimeNs step = FromSeconds(1.0 / rate);
      if (20 * step > period * unit || step < unit) continue;
      WrappedClock clock;
      const TimeNs start = period * unit - 10 * step;
      for (int i = 0; i < 100; ++i) {
        const TimeNs t = start + i * step;
        EXPECT_EQ(clock.Undo(t % (period * unit)), t) << period << " " << unit << " " << rate;
      }
      EXPECT_THAT(clock.Text(), HasSubstr("wraps"));
    }
  }
}

TEST(WrappedClock, ARestartIsNoWrap) {
  WrappedClock clock;
  for (int i = 0; i < 100; ++i) clock.Undo(FromSeconds(500.0 + 0.01 * i));
  EXPECT_EQ(clock.Undo(FromSeconds(1.0)), FromSeconds(1.0));
  EXPECT_EQ(clock.Text(), "");
}

TEST(SharedStamps, AreSpreadUpToTheStampAndStated) {
  const ImportFiles files;
  for (const int queue : {2, 3, 5}) {
    std::string csv = "t,a\n";
    for (int i = 0; i < 60 * queue; ++i) {
      csv += fmt::format("{},{}\n", 4000 * queue * (i / queue + 1), i);
    }
    const FlightLog log = files.Convert(kStampsMap, csv);
    ASSERT_EQ(log.imu.size(), 60U * static_cast<unsigned>(queue));
    for (std::size_t i = 1; i < log.imu.size(); ++i) {
      EXPECT_EQ(log.imu[i].t - log.imu[i - 1].t, 4'000'000) << queue;
    }
    EXPECT_EQ(log.imu.back().t, 240'000'000 * queue);
    EXPECT_THAT(log.warnings, Contains(HasSubstr("share the stamp")));
    EXPECT_EQ(log.source.at("imu spread"), fmt::format("{:.3f}", 1.0 - 1.0 / queue));
  }
}

TEST(SharedStamps, ARowThatIsWrittenTwiceIsOne) {
  const ImportFiles files;
  std::string csv = "t,a\n";
  for (int i = 0; i < 100; ++i) csv += fmt::format("{0},{1}\n{0},{1}\n", 4000 * i, i);
  const FlightLog log = files.Convert(kStampsMap, csv);
  EXPECT_EQ(log.imu.size(), 100U);
  EXPECT_EQ(log.imu[1].t - log.imu[0].t, 4'000'000);
}

TEST(RowsLost, AreStatedInTheLog) {
  const ImportFiles files;
  std::string csv = "t,a\n";
  for (int i = 0; i < 60; ++i) csv += fmt::format("{},1\n", 9'000'000 + 4000 * i);
  for (int i = 0; i < 40; ++i) csv += fmt::format("{},1\n", 4000 * i);
  std::string map = kStampsMap;
  map.replace(map.find("unit: us}"), 9, "unit: us}, unsorted: drop");
  const FlightLog log = files.Convert(map, csv);
  EXPECT_EQ(log.imu.size(), 60U);
  EXPECT_EQ(log.source.at("imu lost"), "0.400");
}

TEST(LeaveOut, RemovesRowsOfTheseTimes) {
  const ImportFiles files;
  std::string csv = "t,a\n";
  for (int i = 0; i < 100; ++i) csv += fmt::format("{},1\n", 10'000 * i);
  std::string map = kStampsMap;
  map.replace(map.find("{accel"), 1, "{leave_out: [[0.2, 0.295]], ");
  EXPECT_EQ(files.Convert(map, csv).imu.size(), 90U);
}

// --- Packed files

std::string Gzip(const std::string& text) {
  std::string packed(compressBound(text.size()) + 64, '\0');
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, 31, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string Bzip2(const std::string& text) {
  std::string packed(text.size() + 700, '\0');
  auto size = static_cast<unsigned>(packed.size());
  BZ2_bzBuffToBuffCompress(packed.data(), &size, const_cast<char*>(text.data()),
                           static_cast<unsigned>(text.size()), 9, 0, 0);
  packed.resize(size);
  return packed;
}

std::string Xz(const std::string& text) {
  std::string packed(text.size() + 1000, '\0');
  std::size_t size = 0;
  lzma_easy_buffer_encode(6, LZMA_CHECK_CRC64, nullptr,
                          reinterpret_cast<const std::uint8_t*>(text.data()), text.size(),
                          reinterpret_cast<std::uint8_t*>(packed.data()), &size, packed.size());
  packed.resize(size);
  return packed;
}

std::string Zstd(const std::string& text) {
  std::string packed(ZSTD_compressBound(text.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), text.data(), text.size(), 3));
  return packed;
}

std::string Tar(const std::string& name, const std::string& text) {
  std::string head(512, '\0');
  head.replace(0, name.size(), name);
  head.replace(124, 12, fmt::format("{:011o} ", text.size()));
  head.replace(156, 1, "0");
  head.replace(257, 8, std::string("ustar  \0", 8));
  return head + text + std::string((512 - text.size() % 512) % 512 + 1024, '\0');
}

// A member that is stored as it is.
std::string Zip(const std::string& name, const std::string& text) {
  const auto number = [](std::size_t value, int bytes) {
    std::string little;
    for (int i = 0; i < bytes; ++i) little += static_cast<char>(value >> (8 * i) & 255);
    return little;
  };
  const std::string common = number(0, 2) + number(0, 2) + number(0, 4) + number(0, 4) +
                             number(text.size(), 4) + number(text.size(), 4) +
                             number(name.size(), 2) + number(0, 2);
  const std::string local = "PK\x03\x04" + number(20, 2) + common + name + text;
  const std::string central = "PK\x01\x02" + number(20, 2) + number(20, 2) + common + number(0, 2) +
                              number(0, 2) + number(0, 2) + number(0, 4) + number(0, 4) + name;
  return local + central + "PK\x05\x06" + number(0, 4) + number(1, 2) + number(1, 2) +
         number(central.size(), 4) + number(local.size(), 4) + number(0, 2);
}

TEST(PackedFiles, AreReadAsWhatTheyHold) {
  const ImportFiles files;
  std::string csv = "t,a\n";
  for (int i = 0; i < 500; ++i) csv += fmt::format("{},{}\n", 4000 * i, i);
  const std::string map = files.Write("map.yaml", kStampsMap);
  const auto packed = {std::pair{"a.csv.gz", Gzip(csv)},
                       {"a.csv.bz2", Bzip2(csv)},
                       {"a.csv.xz", Xz(csv)},
                       {"a.csv.zst", Zstd(csv)},
                       {"a.tar", Tar("a.csv", csv)},
                       {"a.tgz", Gzip(Tar("a.csv", csv))},
                       {"a.zip", Zip("a.csv", csv)}};
  for (const auto& [name, bytes] : packed) {
    const FlightLog log = ConvertLog(ReadImportMap(map), {files.Write(name, bytes)}, {});
    EXPECT_EQ(log.imu.size(), 500U) << name;
    EXPECT_EQ(log.name, "a") << name;
    const std::string cut =
        files.Write(std::string("cut_") + name, bytes.substr(0, bytes.size() / 2));
    const std::string error = ErrorOf([&] { ConvertLog(ReadImportMap(map), {cut}, {}); });
    EXPECT_THAT(error, HasSubstr(cut)) << name;
    EXPECT_THAT(error, HasSubstr("damaged or cut off")) << name;
  }
}

}  // namespace
}  // namespace trueline
