// One flight as tables whose names do not tell what the numbers mean: the log shows it.
#include "problems/inspection/settle_proposal.h"

#include <fmt/format.h>

#include <fstream>

#include "tests/common/test_files.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

const FlightLog& Flight(const std::string& name) {
  static std::map<std::string, FlightLog> logs;
  if (!logs.contains(name)) logs[name] = testing_simulation::LogOf(name, 30.0, 7);
  return logs[name];
}

constexpr double kDeg = 180.0 / M_PI;

struct Table {
  const char* attitude = "qw,qx,qy,qz";
  std::array<int, 4> order = {0, 1, 2, 3};  // of w, x, y, z, as written
  bool inverse = false;
  double gyro = 1.0, place = 1.0;
  Eigen::Vector3d angle = Eigen::Vector3d::Zero();  // of roll, pitch and yaw; 0: quaternions
  double yaw = 0.0;                                 // rad, added
  bool turned_xyz = false;                          // by roll, pitch, yaw in this order of Rx Ry Rz
  bool in_earth = false, no_gravity = false, up = false;  // of acceleration; axes ENU and FLU
  const char* flight = "figure_eight";
  const char* imu = "ax,ay,az,gx,gy,gz";
};

class SettleProposalTest : public testing::Test {
 protected:
  FlightLog Read(const Table& table) {
    const FlightLog& log = Flight(table.flight);
    Eigen::Matrix3d earth = Eigen::Matrix3d::Identity(), body = earth;
    if (table.up) earth << 0, 1, 0, 1, 0, 0, 0, 0, -1;
    if (table.up) body.diagonal() << 1, -1, -1;
    std::ofstream file(folder_ / "flight.csv");
    file << "t," << table.imu << "," << table.attitude << ",x,y,z\n";
    std::size_t k = 0;
    for (std::size_t i = 0; i < log.attitude.size() && i < log.imu.size(); i += 4) {
      const ImuSample& imu = log.imu[i];
      while (k + 1 < log.mocap.size() && log.mocap[k + 1].t <= imu.t) ++k;
      file << fmt::format("{:.6f}", ToSeconds(imu.t));
      Eigen::Quaterniond q(earth * log.attitude[i].q_Ep_I.toRotationMatrix() * body);
      Eigen::Vector3d accel = body * imu.accel;
      if (table.no_gravity) accel += q.conjugate() * earth * Eigen::Vector3d(0, 0, log.gravity);
      if (table.in_earth) accel = q * accel;
      Write(&file, accel);
      Write(&file, table.gyro * (body * imu.gyro));
      if (table.inverse) q = q.conjugate();
      if (!table.angle.isZero()) {
        const Eigen::Matrix3d m = q.toRotationMatrix();
        Eigen::Vector3d angles(std::atan2(m(2, 1), m(2, 2)), -std::asin(m(2, 0)),
                               std::atan2(m(1, 0), m(0, 0)) + table.yaw);
        if (table.turned_xyz) {
          angles << std::atan2(-m(1, 2), m(2, 2)), std::asin(m(0, 2)),
              std::atan2(-m(0, 1), m(0, 0));
        }
        Write(&file, table.angle.cwiseProduct(angles));
      } else {
        const std::array<double, 4> parts = {q.w(), q.x(), q.y(), q.z()};
        for (const int part : table.order) {
          file << fmt::format(",{:.9f}", parts[static_cast<std::size_t>(part)]);
        }
      }
      Write(&file, table.place * (earth * log.mocap[k].p_E));
      file << "\n";
    }
    file.close();
    const FlightLog read = ReadAnyLog((folder_ / "flight.csv").string());
    warnings_ = read.warnings;
    return read;
  }
  // Turn rates, attitudes and places are those of the flight.
  void ExpectFlight(const Table& table) {
    const FlightLog& good = Flight(table.flight);
    const FlightLog log = Read(table);
    ASSERT_GT(log.imu.size(), 1000U);
    EXPECT_LT((log.imu[500].gyro - good.imu[2000].gyro).norm(), 1e-4);
    EXPECT_LT((log.imu[500].accel - good.imu[2000].accel).norm(), 1e-2);
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

  static void Write(std::ofstream* file, const Eigen::Vector3d& v) {
    *file << fmt::format(",{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z());
  }

  TestFolder folder_;
  std::vector<std::string> warnings_;
};

TEST_F(SettleProposalTest, WhatTheNamesSayIsLeftWhereTheLogAgrees) {
  ExpectFlight({});
  EXPECT_THAT(warnings_, Not(Contains(HasSubstr("as the log shows"))));
}

TEST_F(SettleProposalTest, TurnRatesMayBeInDegreesOrThousandths) {
  ExpectFlight({.gyro = kDeg});
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
  ExpectFlight({.attitude = "roll,pitch,yaw", .angle = {1, 1, 1}});
  ExpectFlight({.attitude = "roll,pitch,yaw", .angle = {kDeg, kDeg, kDeg}});
}

TEST_F(SettleProposalTest, AnglesMayHaveSignsUnitsAndAnOrderOfTheirOwn) {
  const Table table{.attitude = "roll,pitch,yaw", .flight = "hippodrome"};
  for (const Eigen::Vector3d& angle : std::vector<Eigen::Vector3d>{
           {1, -1, 1}, {-kDeg, kDeg, kDeg}, {1, 1, kDeg}, {kDeg, kDeg, 1}}) {
    Table other = table;
    other.angle = angle;
    ExpectFlight(other);
    EXPECT_THAT(warnings_, Contains(HasSubstr("the angles of"))) << angle.transpose();
  }
  // Roll and pitch of the other sign: body and earth are turned by half a turn at once.
  Table two = table, enu = table, xyz = table;
  two.angle = {-1, -1, 1};
  ExpectFlight(two);
  enu.angle = {1, 1, -1};
  enu.yaw = -M_PI / 2;
  ExpectFlight(enu);
  xyz.angle = {1, 1, 1};
  xyz.turned_xyz = true;
  ExpectFlight(xyz);
}

TEST_F(SettleProposalTest, AccelerationsMayBeOfTheEarthAndWithoutGravity) {
  for (const bool up : {false, true}) {
    ExpectFlight({.in_earth = true, .up = up, .flight = "hippodrome"});
    ExpectFlight({.no_gravity = true, .up = up, .flight = "hippodrome"});
    ExpectFlight({.in_earth = true, .no_gravity = true, .up = up, .flight = "hippodrome"});
    EXPECT_THAT(warnings_, Contains(HasSubstr("without gravity")));
  }
}

// EuRoC's IMU stands upright, and its map says so. Others write such folders, too.
TEST_F(SettleProposalTest, AnAslFolderMayHoldADroneWhoseImuLiesFlat) {
  const FlightLog& log = Flight("figure_eight");
  for (const char* sensor : {"imu0", "state_groundtruth_estimate0"}) {
    std::filesystem::create_directories(folder_ / "asl" / "mav0" / sensor);
  }
  std::ofstream imu(folder_ / "asl/mav0/imu0/data.csv");
  imu << "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
         "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  const Eigen::DiagonalMatrix<double, 3> flat(1, -1, -1);
  for (const ImuSample& sample : log.imu) {
    imu << sample.t;
    Write(&imu, flat * sample.gyro);
    Write(&imu, flat * sample.accel);
    imu << "\n";
  }
  std::ofstream truth(folder_ / "asl/mav0/state_groundtruth_estimate0/data.csv");
  truth << "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [],"
           " q_RS_z []\n";
  for (const PoseSample& sample : log.mocap) {
    const Eigen::Quaterniond q(flat * sample.q_E.toRotationMatrix() * flat);
    truth << sample.t;
    Write(&truth, flat * sample.p_E);
    truth << fmt::format(",{},{},{},{}\n", q.w(), q.x(), q.y(), q.z());
  }
  imu.close(), truth.close();
  const FlightLog read = ReadAnyLog((folder_ / "asl").string());
  EXPECT_THAT(read.warnings, Contains(HasSubstr("earth NWU, body FLU")));
  EXPECT_LT((read.imu.front().accel - log.imu.front().accel).norm(), 1e-6);
  EXPECT_LT((read.mocap.front().p_E - log.mocap.front().p_E).norm(), 1e-6);
}

TEST_F(SettleProposalTest, SeveralGuessesMayBeWrongAtOnce) {
  ExpectFlight(
      {.attitude = "q[0],q[1],q[2],q[3]", .order = {1, 2, 3, 0}, .gyro = kDeg, .place = 100.0});
}

}  // namespace
}  // namespace trueline
