// One flight as tables whose names do not tell what the numbers mean: the log shows it.
#include "problems/inspection/settle_proposal.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "tests/common/test_files.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

using testing::Contains;
using testing::HasSubstr;

const FlightLog& Gentle() {
  static const FlightLog log = testing_simulation::LogOf("figure_eight", 30.0, 7);
  return log;
}

struct Table {
  const char* attitude = "qw,qx,qy,qz";
  std::array<int, 4> order = {0, 1, 2, 3};  // of w, x, y, z, as written
  bool inverse = false;
  double gyro = 1.0, place = 1.0, angle = 0.0;  // angle: of roll, pitch and yaw, 0 for quaternions
  const char* imu = "ax,ay,az,gx,gy,gz";
};

class SettleProposalTest : public testing::Test {
 protected:
  FlightLog Read(const Table& table) {
    const FlightLog& log = Gentle();
    std::ofstream file(folder_ / "flight.csv");
    file << "t," << table.imu << "," << table.attitude << ",x,y,z\n";
    std::size_t k = 0;
    for (std::size_t i = 0; i < log.attitude.size() && i < log.imu.size(); i += 4) {
      const ImuSample& imu = log.imu[i];
      while (k + 1 < log.mocap.size() && log.mocap[k + 1].t <= imu.t) ++k;
      file << fmt::format("{:.6f}", ToSeconds(imu.t));
      Write(&file, imu.accel);
      Write(&file, table.gyro * imu.gyro);
      const Eigen::Quaterniond q =
          table.inverse ? log.attitude[i].q_Ep_I.conjugate() : log.attitude[i].q_Ep_I;
      if (table.angle > 0.0) {
        const Eigen::Matrix3d m = q.toRotationMatrix();
        Write(&file,
              table.angle * Eigen::Vector3d(std::atan2(m(2, 1), m(2, 2)), -std::asin(m(2, 0)),
                                            std::atan2(m(1, 0), m(0, 0))));
      } else {
        const std::array<double, 4> parts = {q.w(), q.x(), q.y(), q.z()};
        for (const int part : table.order) {
          file << fmt::format(",{:.9f}", parts[static_cast<std::size_t>(part)]);
        }
      }
      Write(&file, table.place * log.mocap[k].p_E);
      file << "\n";
    }
    file.close();
    const FlightLog read = ReadAnyLog((folder_ / "flight.csv").string());
    warnings_ = read.warnings;
    return read;
  }
  // Turn rates, attitudes and places are those of the flight.
  void ExpectFlight(const Table& table) {
    const FlightLog& good = Gentle();
    const FlightLog log = Read(table);
    ASSERT_GT(log.imu.size(), 1000U);
    EXPECT_LT((log.imu[500].gyro - good.imu[2000].gyro).norm(), 1e-4);
    ASSERT_EQ(log.attitude.size(), log.imu.size());
    EXPECT_LT(log.attitude[500].q_Ep_I.angularDistance(good.attitude[2000].q_Ep_I), 1e-3);
    const auto place = [](const FlightLog& of) {
      Eigen::AlignedBox3d box;
      for (const PoseSample& pose : of.mocap) box.extend(pose.p_E);
      for (const Fix& fix : of.fixes) box.extend(fix.p_E);
      return box.diagonal().norm();
    };
    FlightLog alone;
    alone.mocap = good.mocap;
    EXPECT_NEAR(place(log), place(alone), 0.02);
  }

  TestFolder folder_;
  std::vector<std::string> warnings_;

 private:
  static void Write(std::ofstream* file, const Eigen::Vector3d& v) {
    *file << fmt::format(",{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z());
  }
};

TEST_F(SettleProposalTest, WhatTheNamesSayIsLeftWhereTheLogAgrees) {
  ExpectFlight({});
  EXPECT_THAT(warnings_, Not(Contains(HasSubstr("as the log shows"))));
}

TEST_F(SettleProposalTest, TurnRatesMayBeInDegreesOrThousandths) {
  ExpectFlight({.gyro = 180.0 / M_PI});
  ExpectFlight({.gyro = 1000.0});
  EXPECT_THAT(warnings_, Contains(HasSubstr("as the log shows")));
}

TEST_F(SettleProposalTest, PlacesMayBeInMillimetres) {
  ExpectFlight({.place = 1000.0});
  EXPECT_THAT(warnings_, Contains(HasSubstr("as the log shows")));
}

TEST_F(SettleProposalTest, NumberedQuaternionsMayHaveTheScalarLast) {
  ExpectFlight({.attitude = "q[0],q[1],q[2],q[3]", .order = {1, 2, 3, 0}});
  ExpectFlight({.attitude = "q0,q1,q2,q3", .order = {0, 1, 2, 3}});
}

TEST_F(SettleProposalTest, QuaternionsMayBeFromEarthToBody) { ExpectFlight({.inverse = true}); }

TEST_F(SettleProposalTest, AnglesInDegreesAreToldByRollAndPitchToo) {
  ExpectFlight({.attitude = "roll,pitch,yaw", .angle = 1.0});
  ExpectFlight({.attitude = "roll,pitch,yaw", .angle = 180.0 / M_PI});
}

TEST_F(SettleProposalTest, SeveralGuessesMayBeWrongAtOnce) {
  ExpectFlight({.attitude = "q[0],q[1],q[2],q[3]",
                .order = {1, 2, 3, 0},
                .gyro = 180.0 / M_PI,
                .place = 100.0});
}

}  // namespace
}  // namespace trueline
