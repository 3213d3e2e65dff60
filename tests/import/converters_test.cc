// Tables as the usual converters write them convert without a map, with the values that were
// logged.
#include <fmt/format.h>

#include <cmath>

#include "problems/import/convert.h"
#include "problems/import/find_map.h"
#include "problems/import/formats/csv_table.h"
#include "tests/import/import_files.h"

namespace trueline {
namespace {

constexpr int kTableRows = 60;

class Converters : public testing::Test {
 protected:
  // A line of names, and rows by `row` of the number of the row.
  template <class Row>
  std::string Table(const std::string& name, const std::string& names, const Row& row,
                    int rows = kTableRows) {
    std::string text = names + "\n";
    for (int i = 0; i < rows; ++i) text += row(i) + "\n";
    return files_.Write(name, text);
  }
  static FlightLog Read(const std::vector<std::string>& files) {
    return ConvertFound(FindLog(files), {});
  }
  static void ExpectImu(const FlightLog& log, double tolerance = 1e-9) {
    ASSERT_EQ(log.imu.size(), static_cast<std::size_t>(kTableRows));
    EXPECT_LT((log.imu[7].accel - Eigen::Vector3d(0.1, -0.2, -9.81)).norm(), tolerance);
    EXPECT_LT((log.imu[7].gyro - Eigen::Vector3d(0.7, 0.02, 0.03)).norm(), tolerance);
    EXPECT_NEAR(SecondsBetween(log.imu[0].t, log.imu[50].t), 0.2, 1e-6);
  }

  ImportFiles files_;
};

TEST_F(Converters, Ulog2csvFilesAreTheLogThatTheyWereMadeOf) {
  const std::string imu = Table(
      "log_7_sensor_combined_0.csv",
      "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,"
      "accelerometer_timestamp_relative,accelerometer_m_s2[0],accelerometer_m_s2[1],"
      "accelerometer_m_s2[2]",
      [](int i) {
        return fmt::format("{},{},0.02,0.03,4000,0,0.1,-0.2,-9.81", 5'000'000 + 4000 * i, 0.1 * i);
      });
  const std::string gps = Table(
      "log_7_vehicle_gps_position_0.csv", "timestamp,lat,lon,alt,eph,fix_type",
      [](int i) {
        return fmt::format("{},{},80000000,500000,0.8,3", 5'000'000 + 200'000 * i,
                           470000000 + 10 * i);
      },
      12);
  const FlightLog log = Read({imu, gps});
  ExpectImu(log);
  ASSERT_EQ(log.fixes.size(), 12U);
  EXPECT_NEAR(log.fixes[5].p_E.x(), 0.556, 0.005);  // 5e-6 deg of latitude
  EXPECT_EQ(log.fixes[0].sigma, 0.8);
  EXPECT_EQ(Read({imu.substr(0, imu.rfind('/'))}).imu.size(), log.imu.size());  // the folder
}

TEST_F(Converters, SparseTablesHaveChannelsByTopic) {
  const std::string file = Table(
      "plot.csv",
      "__time,/imu/angular_velocity/x,/imu/angular_velocity/y,/imu/angular_velocity/z,"
      "/imu/linear_acceleration/x,/imu/linear_acceleration/y,/imu/linear_acceleration/z,"
      "/imu/orientation/w,/imu/orientation/x,/imu/orientation/y,/imu/orientation/z,"
      "/vicon/pose/position/x,/vicon/pose/position/y,/vicon/pose/position/z",
      [](int i) {
        const double t = 1.7e9 + 0.002 * i;
        return i % 2 == 0
                   ? fmt::format("{:.6f},{},-0.02,-0.03,0.1,0.2,9.81,1,0,0,0,,,", t, 0.05 * i)
                   : fmt::format("{:.6f},,,,,,,,,,,{},2,3", t, i);
      },
      2 * kTableRows);
  const FlightLog log = Read({file});
  ExpectImu(log);
  EXPECT_EQ(log.attitude.size(), log.imu.size());
  ASSERT_EQ(log.fixes.size(), static_cast<std::size_t>(kTableRows));
  EXPECT_EQ(log.fixes[0].p_E, Eigen::Vector3d(2, 1, -3));  // from east-north-up
}

TEST_F(Converters, TopicsOfRosMayBeInFilesOfTheirOwn) {
  const std::string imu = Table(
      "imu.csv",
      "%time,field.header.seq,field.header.stamp,field.orientation.x,field.orientation.y,"
      "field.orientation.z,field.orientation.w,field.angular_velocity.x,field.angular_velocity.y,"
      "field.angular_velocity.z,field.linear_acceleration.x,field.linear_acceleration.y,"
      "field.linear_acceleration.z",
      [](int i) {  // recorded 10 ms after the measurement
        return fmt::format("{},{},{},0,0,0,1,{},-0.02,-0.03,0.1,0.2,9.81",
                           1'700'000'000'010'000'000 + 4'000'000 * i, i,
                           1'700'000'000'000'000'000 + 4'000'000 * i, 0.1 * i);
      });
  const std::string pose = Table(
      "pose.csv",
      "header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,pose.position.z,"
      "pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w",
      [](int i) { return fmt::format("1700000000,{},{},2,3,0,0,0,1", 10'000'000 * i, i); }, 20);
  const FlightLog log = Read({imu, pose});
  ExpectImu(log);
  EXPECT_EQ(log.imu[0].t, 1'700'000'000 * kNsPerSecond);
  ASSERT_EQ(log.mocap.size(), 20U);
  EXPECT_EQ(log.mocap[3].t, 1'700'000'000 * kNsPerSecond + 30'000'000);
}

TEST_F(Converters, TheNamesOfABlackboxTableFollowItsHead) {
  std::string head = "\"Product\",\"Blackbox flight data recorder by Nicholas Sherlock\"\n";
  for (int i = 0; i < 30; ++i) head += fmt::format("\"setting_{}\",\"45,80,40\"\n", i);
  head += "\"acc_1G\",2048\n";
  const std::string file =
      Table("explorer.csv",
            head +
                "\"loopIteration\",\"time\",\"gyroADC[0]\",\"gyroADC[1]\",\"gyroADC[2]\","
                "\"accSmooth[0]\",\"accSmooth[1]\",\"accSmooth[2]\",\"GPS_coord[0]\","
                "\"GPS_coord[1]\",\"GPS_altitude\"",
            [](int i) {
              return fmt::format("{},{},90,0,0,0,0,2048,{},80000000,5000", 8 * i,
                                 33'000'000 + 4000 * i, 470000000 + 10 * (i / 20));
            });
  const FlightLog log = Read({file});
  ASSERT_EQ(log.imu.size(), static_cast<std::size_t>(kTableRows));
  EXPECT_NEAR(log.imu[0].accel.z(), -9.80665, 1e-9);
  EXPECT_NEAR(log.imu[0].gyro.x(), M_PI / 2, 1e-9);
  EXPECT_EQ(log.fixes.size(), 3U);  // held values are one fix
}

TEST_F(Converters, ADataFlashLogMayBeText) {
  std::string text =
      "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\r\n"
      "FMT, 162, 36, IMU, QBffffff, TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ\r\n"
      "FMT, 118, 24, GPS, QBLLe, TimeUS,Status,Lat,Lng,Alt\r\n";
  for (int i = 0; i < kTableRows; ++i) {
    text += fmt::format("IMU, {}, 0, {}, 0.02, 0.03, 0.1, -0.2, -9.81\r\n", 4000 * i, 0.1 * i);
    if (i % 10 == 0) text += fmt::format("GPS, {}, 3, 47.0000001, 8.0000000, 500.25\r\n", 4000 * i);
  }
  const FlightLog log = Read({files_.Write("00000005.log", text)});
  ExpectImu(log, 1e-6);
  ASSERT_EQ(log.fixes.size(), 6U);
  EXPECT_LT(log.fixes[3].p_E.norm(), 1e-6);
}

TEST_F(Converters, MessagesOfOneTableAreToldApartByTheirNames) {
  const std::string file = Table(
      "mavlogdump.csv",
      "timestamp,IMU.TimeUS,IMU.I,IMU.GyrX,IMU.GyrY,IMU.GyrZ,IMU.AccX,IMU.AccY,IMU.AccZ,"
      "GPS.TimeUS,GPS.Status,GPS.Lat,GPS.Lng,GPS.Alt",
      [](int i) {
        const int us = 2000 * i;
        const double t = 1.7e9 + 1e-6 * us;
        return i % 2 == 0
                   ? fmt::format("{:.6f},{},0,{},0.02,0.03,0.1,-0.2,-9.81,,,,,", t, us, 0.05 * i)
                   : fmt::format("{:.6f},,,,,,,,,{},3,47,8,500", t, us);
      },
      2 * kTableRows);
  const FlightLog log = Read({file});
  ExpectImu(log);
  EXPECT_EQ(log.fixes.size(), static_cast<std::size_t>(kTableRows));
}

TEST_F(Converters, TheGyroscopeMayComeFromAnotherFile) {
  const auto acc = [&](double start) {
    return Table("acc.csv", "timestamp,acc.x,acc.y,acc.z",
                 [start](int i) { return fmt::format("{},0,0,1", start + 4 * i); });
  };
  const std::string gyro = Table("gyr.csv", "timestamp,gyro.x,gyro.y,gyro.z", [](int i) {
    return fmt::format("{},{},0,0", 998 + 4 * i, 10 * i);
  });
  const std::string pos =
      Table("pos.csv", "timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z",
            [](int i) { return fmt::format("{},1,2,3", 1000 + 10 * i); });
  const std::string map =
      files_.Write("map.yaml",
                   "inputs:\n"
                   "  acc: {time: {column: timestamp, unit: ms}}\n"
                   "  gyr: {time: {column: timestamp, unit: ms}}\n"
                   "streams:\n"
                   "  imu:\n"
                   "    input: acc\n"
                   "    skip_missing: true\n"
                   "    accel: {columns: [acc.x, acc.y, acc.z], unit: g}\n"
                   "    gyro: {input: gyr, columns: [gyro.x, gyro.y, gyro.z], unit: rad/s}\n");
  const FlightLog log = ConvertLog(ReadImportMap(map), {acc(1000), gyro}, {});
  ASSERT_EQ(log.imu.size(), kTableRows - 1U);      // the last one lies after the gyroscope's
  EXPECT_NEAR(log.imu[10].gyro.x(), 105.0, 1e-9);  // between two samples
  EXPECT_EQ(Read({acc(1000), gyro, pos}).imu.size(), static_cast<std::size_t>(kTableRows));
  const std::string apart = acc(9000);
  EXPECT_THAT(ErrorOf([&] {
                ConvertLog(ReadImportMap(map), {apart, gyro}, {});
              }),
              HasSubstr("do not overlap in time"));
  EXPECT_THAT(ErrorOf([&] { Read({apart, gyro, pos}); }), HasSubstr("do not overlap in time"));
}

TEST_F(Converters, AttitudesMayBeMatrices) {
  const double c = std::cos(0.5), s = std::sin(0.5);  // turned by 0.5 rad about z
  for (const char* names : {"r11,r12,r13,r21,r22,r23,r31,r32,r33",
                            "rot[0],rot[1],rot[2],rot[3],rot[4],rot[5],rot[6],rot[7],rot[8]",
                            "rot_xx,rot_xy,rot_xz,rot_yx,rot_yy,rot_yz,rot_zx,rot_zy,rot_zz"}) {
    const std::string file =
        Table("matrix.csv", std::string("t,ax,ay,az,gx,gy,gz,x,y,z,") + names, [&](int i) {
          return fmt::format("{:.3f},0.1,-0.2,-9.81,{},0.02,0.03,{},2,-1,{},{},0,{},{},0,0,0,1",
                             0.004 * i, 0.1 * i, i, c, -s, s, c);
        });
    const FlightLog log = Read({file});
    ExpectImu(log);
    ASSERT_EQ(log.attitude.size(), log.imu.size()) << names;
    EXPECT_NEAR(log.attitude[7].q_Ep_I.z(), std::sin(0.25), 1e-9);
  }
}

// The names are those of a Crazyflie, whose accelerometer is in g; the numbers are in m/s^2.
TEST_F(Converters, NumbersCountBeforeTheMapThatNamesSuit) {
  const std::string file = Table("crazy.csv",
                                 "timestamp,acc.x,acc.y,acc.z,gyro.x,gyro.y,gyro.z,stateEstimate.x,"
                                 "stateEstimate.y,stateEstimate.z",
                                 [](int i) {
                                   return fmt::format("{},0.1,-0.2,-9.81,{},0.02,0.03,{},2,-1",
                                                      1000 + 4 * i, 0.1 * i, i);
                                 });
  ExpectImu(Read({file}));
}

TEST_F(Converters, VelocitiesStandForPositionsThatAreMissing) {
  const std::string file = Table(
      "v.csv", "timestamp,vx,vy,vz,ang_vel_x,ang_vel_y,ang_vel_z,acc_b_x,acc_b_y,acc_b_z",
      [](int i) {
        return fmt::format("{},1,{},0,{},0.02,0.03,0.1,-0.2,-9.81", 4000 * i, 0.5 * i, 0.1 * i);
      });
  const FoundLog found = FindLog({file});
  const FlightLog log = ConvertFound(found, {});
  ExpectImu(log);
  ASSERT_EQ(log.fixes.size(), static_cast<std::size_t>(kTableRows));
  EXPECT_NEAR(log.fixes[50].p_E.x(), 0.2, 1e-9);
  EXPECT_NEAR(log.fixes[50].p_E.y(), 0.5 * 25 * 0.2, 1e-9);
  EXPECT_FALSE(AssumptionWarnings(found).empty());
}

// A table of IMU, attitude and positions that are held between fixes.
TEST_F(Converters, HeldPositionsAreFixesWhereTheyChange) {
  const std::string file = Table(
      "t.csv", "t,ax,ay,az,gx,gy,gz,qw,qx,qy,qz,x,y,z",
      [](int i) {
        return fmt::format("{:.3f},0.1,-0.2,-9.81,{},0.02,0.03,{},{},0,0,{},2,3", 0.004 * i,
                           0.1 * i, std::cos(0.01 * i), std::sin(0.01 * i), i / 10);
      },
      200);
  const FlightLog log = Read({file});
  EXPECT_EQ(log.attitude.size(), 200U);
  EXPECT_EQ(log.fixes.size(), 19U);
}

TEST_F(Converters, ARunningNumberIsNoTimeAndTheStampOfMeasurementCounts) {
  const auto layout = [&](const std::string& text) {
    return GuessCsvLayout(files_.Write("a.csv", text));
  };
  EXPECT_EQ(layout(",x,sensor_time\n0,1,0.50\n1,1,0.51\n2,1,0.52\n3,1,0.53\n").time->column, 2U);
  EXPECT_FALSE(layout("n,x\n0,5\n1,4\n2,6\n3,5\n").time);
  EXPECT_EQ(
      layout("receive_time,timestamp_sample\n1.0,1.1\n1.1,1.2\n1.2,1.3\n1.3,1.4\n").time->column,
      1U);
}

TEST_F(Converters, NamelessTrajectoriesAreKnownByTheirShape) {
  const std::string vins =
      Table("vio.csv", "1403715273262142976,1,2,3,1,0,0,0,0.1,0.2,0.3,", [](int i) {
        return fmt::format("{},1,2,3,1,0,0,0,0.1,0.2,0.3,", 1403715273267142976 + 5'000'000 * i);
      });
  const CsvLayout layout = GuessCsvLayout(vins);
  EXPECT_TRUE(layout.has_made_names);
  EXPECT_EQ(layout.columns[4], "qw");
  EXPECT_EQ(layout.time->exponent, 0);
}

}  // namespace
}  // namespace trueline
