// The map that is proposed for a CSV file of unknown columns: each converts as it is.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/import/find_map.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "tests/import/import_files.h"
#include "tests/import/mcap_writer.h"

namespace trueline {
namespace {

constexpr char kImuNames[] = "time,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z";
constexpr char kImuRow[] = ",0,0,-9.81,0,0,0.5";

class Proposal : public testing::Test {
 protected:
  // The log of three equal rows below the lines given; each has the time before it.
  FlightLog Convert(const std::string& names, const std::string& row) {
    std::string csv = names;
    for (const char* t : {"0.00", "0.01", "0.02"}) csv += std::string(t) + row + "\n";
    const std::string file = files_.Write("flight.csv", csv);
    map_ = ProposeMap(OpenRecording(file).get());
    return ConvertLog(ReadImportMap(files_.Write("map.yaml", map_)), {file}, {});
  }
  // The same with further columns beside an IMU's.
  FlightLog Beside(const std::string& names, const std::string& row) {
    return Convert(std::string(kImuNames) + names + "\n", kImuRow + row);
  }

  ImportFiles files_;
  std::string map_;
};

TEST_F(Proposal, APositionWithoutAnAttitudeIsAFix) {
  for (const char* position : {"pos_x,pos_y,pos_z", "x,y,z", "tx,ty,tz", "x_pos,y_pos,z_pos"}) {
    const FlightLog log = Beside(std::string(",") + position, ",1,2,3");
    ASSERT_EQ(log.fixes.size(), 3U) << map_;
    EXPECT_EQ(log.fixes[0].p_E, Eigen::Vector3d(1, 2, 3)) << map_;
    EXPECT_TRUE(log.mocap.empty());
  }
}

TEST_F(Proposal, APlainAltitudeCountsBeforeABarometers) {
  const FlightLog log = Beside(",baro_alt,lat,lon,alt [m]", ",7,47.4,8.5,488");
  EXPECT_THAT(map_, HasSubstr("geodetic: [\"lat\", \"lon\", \"alt [m]\"]"));
  EXPECT_EQ(log.fixes.size(), 3U);
}

TEST_F(Proposal, AttitudesMayBeAngles) {
  const auto q = [&](const char* names, const char* row) {
    const FlightLog log = Beside(names, row);
    return log.attitude.empty() ? Eigen::Quaterniond::Identity() : log.attitude[0].q_Ep_I;
  };
  const Eigen::Quaterniond yawed(std::cos(0.5), 0, 0, std::sin(0.5));
  EXPECT_LT(q(",roll,pitch,yaw", ",0,0,1").angularDistance(yawed), 1e-9) << map_;
  EXPECT_LT(q(",roll_deg,pitch_deg,yaw_deg", ",0,0,57.29577951308232").angularDistance(yawed), 1e-9)
      << map_;
  // No name states the unit: no angle is as large in rad.
  EXPECT_LT(q(",roll,pitch,yaw", ",0,0,57.29577951308232").angularDistance(yawed), 1e-9) << map_;
  EXPECT_LT(q(",qw [1],qx [1],qy [1],qz [1]", ",0.8775825618903728,0,0,0.479425538604203")
                .angularDistance(yawed),
            1e-9)
      << map_;
  EXPECT_LT(q(",q0,q1,q2,q3", ",0.8775825618903728,0,0,0.479425538604203").angularDistance(yawed),
            1e-9)
      << map_;
}

TEST_F(Proposal, UnitsAreSpelledInManyWays) {
  for (const char* force : {"m/s²", "m s^-2", "m/s**2", "ms-2"}) {
    for (const char* rate : {"°/s", "deg/sec", "degrees/second"}) {
      const FlightLog log = Convert(
          fmt::format(
              "t,acc_x [{0}],acc_y [{0}],acc_z [{0}],gyro_x ({1}),gyro_y ({1}),gyro_z ({1}),"
              "pos_x (meters),pos_y (meters),pos_z (meters)\n",
              force, rate),
          ",0,0,-1.5,0,0,3,1,2,3");
      EXPECT_EQ(log.imu[0].accel.z(), -1.5) << map_;
      EXPECT_NEAR(log.imu[0].gyro.z(), 3.0 * kDegree, 1e-12) << map_;
      EXPECT_EQ(log.fixes[0].p_E.z(), 3.0) << map_;
    }
  }
  const FlightLog suffixes = Convert("t,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n", ",0,0,-1,0,0,90");
  EXPECT_EQ(suffixes.imu[0].accel.z(), -9.80665) << map_;
  EXPECT_NEAR(suffixes.imu[0].gyro.z(), M_PI / 2, 1e-12) << map_;
  EXPECT_NEAR(Beside(",pos_x[ft],pos_y[ft],pos_z[ft]", ",1,2,10").fixes[0].p_E.z(), 3.048, 1e-9)
      << map_;
}

TEST_F(Proposal, MocapHasTheAttitudeOfItsNames) {
  const FlightLog log =
      Beside(",qw,qx,qy,qz,vicon_x,vicon_y,vicon_z,vicon_qw,vicon_qx,vicon_qy,vicon_qz",
             ",1,0,0,0,1,2,3,0,0,0,1");
  EXPECT_NEAR(log.attitude[0].q_Ep_I.angularDistance(log.mocap[0].q_E), M_PI, 1e-6) << map_;
}

TEST_F(Proposal, DeviationsAndGatesAreRead) {
  const FlightLog log = Beside(",pos_x,pos_y,pos_z,sigma,gate_id", ",1,2,3,0.4,7");
  ASSERT_EQ(log.fixes.size(), 3U) << map_;
  EXPECT_EQ(log.fixes[0].sigma, 0.4) << map_;
  EXPECT_EQ(log.fixes[0].gate, 7) << map_;
}

TEST_F(Proposal, MarksOfMissingValuesAndRepeatedNamesAreNoFault) {
  std::string csv = std::string(kImuNames) + ",pos_x,pos_y,pos_z\n";
  const std::string names = csv;
  const char* const marks[] = {"NA", "--", "None", "null", "#N/A"};
  for (int i = 0; i < 50; ++i) {
    const char* mark = marks[i % 5];
    csv += fmt::format("{:.2f},0,0,-9.81,0,0,0.5,{},{},{}\n", 0.01 * i, i % 2 ? "1" : mark,
                       i % 2 ? "2" : mark, i % 2 ? "3" : mark);
    if (i == 20) csv += names + "# a comment\n";
  }
  const std::string file = files_.Write("flight.csv", csv);
  map_ = ProposeMap(OpenRecording(file).get());
  const FlightLog log = ConvertLog(ReadImportMap(files_.Write("map.yaml", map_)), {file}, {});
  EXPECT_EQ(log.imu.size(), 50U) << map_;
  EXPECT_EQ(log.fixes.size(), 25U) << map_;
}

TEST_F(Proposal, QuotedFieldsMayHoldTheDelimiter) {
  const FlightLog log =
      Convert("\"time\",\"note, of all\",acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,x,y,z\n",
              ",\"a, b\",0,0,-9.81,0,0,0.5,1,2,3");
  EXPECT_EQ(log.fixes[0].p_E.z(), 3.0) << map_;
}

// Files of one sensor each, whose names are those of the sensors.
TEST_F(Proposal, BareAxesHaveTheNameOfTheirFile) {
  std::vector<std::string> files;
  for (const auto& [name, row] :
       {std::pair{"accel", "0,0,-9.81"}, {"gyro", "0,0,0.5"}, {"position", "1,2,3"}}) {
    std::string csv = "t,x,y,z\n";
    for (int i = 0; i < 9; ++i) csv += fmt::format("{:.2f},{}\n", 0.01 * i, row);
    files.push_back(files_.Write(fmt::format("{}.csv", name), csv));
  }
  const FlightLog log = ConvertFound(FindLog(files), {});
  EXPECT_EQ(log.imu[0].accel.z(), -9.81);
  EXPECT_EQ(log.imu[4].gyro.z(), 0.5);
  EXPECT_EQ(log.fixes[0].p_E.z(), 3.0);
}

TEST_F(Proposal, ARefusalSaysWhatWasFound) {
  const std::string file =
      files_.Write("flight.csv", "t,gyro_x,gyro_y,gyro_z,a1\n0.1,1,2,3,4\n0.2,1,2,3,4\n");
  const std::string why = WhyNoMapFits(OpenRecording(file).get());
  EXPECT_THAT(why, HasSubstr("has no accelerometer by the names"));
  EXPECT_THAT(why, HasSubstr("The gyroscope is gyro_x, gyro_y, gyro_z"));
  EXPECT_THAT(why, HasSubstr("its fields are t, gyro_x, gyro_y, gyro_z, a1"));
}

TEST_F(Proposal, ALogWithoutNumbersNamesNoFields) {
  const std::string file =
      files_.Write("words.mcap", kMcapStart + McapType(1, "Words") + McapJson(1, "/words", 1) +
                                     McapMessage(1, 1'000'000'000, R"({"said": "hello"})") +
                                     McapRecord(15, "1234"));
  const std::string why = WhyNoMapFits(OpenRecording(file).get());
  EXPECT_THAT(why, HasSubstr("none of its messages has a number that can be read"));
  EXPECT_THAT(why, Not(HasSubstr("its fields are")));
}

TEST_F(Proposal, WhatIsMeasuredCountsBeforeSetpointsAndEstimates) {
  const FlightLog log = Convert(
      "t,ref_pos_x,ref_pos_y,ref_pos_z,est_acc_x,est_acc_y,est_acc_z,imu_acc_x,imu_acc_y,imu_acc_z,"
      "gyro_x,gyro_y,gyro_z,pos_x,pos_y,pos_z\n",
      ",9,9,9,0,0,0,0,0,-9.81,0,0,0,1,2,3");
  EXPECT_EQ(log.imu[0].accel.z(), -9.81) << map_;
  EXPECT_EQ(log.fixes[0].p_E, Eigen::Vector3d(1, 2, 3)) << map_;
  const FlightLog only = Beside(",ref_pos_x,ref_pos_y,ref_pos_z", ",1,2,3");
  EXPECT_EQ(only.fixes.size(), 3U) << map_;
}

TEST_F(Proposal, AxesAndUnitsFollowTheMeanForce) {
  const FlightLog log = Convert(std::string(kImuNames) + "\n", ",0,0,1,0,0,300");
  EXPECT_THAT(map_, HasSubstr("body: FLU"));
  EXPECT_NEAR(log.imu[0].accel.z(), -9.80665, 1e-12) << map_;
  EXPECT_NEAR(log.imu[0].gyro.z(), -300 * M_PI / 180, 1e-12) << map_;
  Convert(std::string(kImuNames) + "\n", kImuRow);
  EXPECT_THAT(map_, HasSubstr("body: FRD"));
}

TEST_F(Proposal, TimesHaveManyNames) {
  const std::string rest = std::string(kImuNames).substr(4) + "\n";
  for (const char* time : {"# time", "%time", "__time", "elapsed_time", "log_time [s]", "clock"}) {
    const FlightLog log = Convert(time + rest, kImuRow);
    EXPECT_EQ(log.imu.size(), 3U) << map_;
    EXPECT_EQ(log.imu[2].t, 20'000'000) << map_;
  }
}

TEST_F(Proposal, UnitsMayHaveALineOfTheirOwn) {
  for (const char* units :
       {"s,g,g,g,deg/s,deg/s,deg/s", "[s],[g],[g],[g],[deg/s],[deg/s],[deg/s]"}) {
    const FlightLog log = Convert(fmt::format("{}\n{}\n", kImuNames, units), ",0,0,-1,0,0,90");
    ASSERT_EQ(log.imu.size(), 3U) << map_;
    EXPECT_THAT(map_, HasSubstr("units_line: true"));
    EXPECT_NEAR(log.imu[0].accel.z(), -9.80665, 1e-12) << map_;
    EXPECT_NEAR(log.imu[0].gyro.z(), M_PI / 2, 1e-12) << map_;
  }
  // A first row with gaps is none.
  EXPECT_FALSE(GuessCsvLayout(files_.Write("gaps.csv", "t,a,b\n1,,\n2,3,4\n")).units_line);
}

TEST_F(Proposal, BarsMaySeparate) {
  std::string names = kImuNames, row = kImuRow;
  std::replace(names.begin(), names.end(), ',', '|');
  std::replace(row.begin(), row.end(), ',', '|');
  EXPECT_EQ(Convert(names + "\n", row).imu.size(), 3U) << map_;
}

TEST_F(Proposal, AxesMayComeFirst) {
  for (const char* names :
       {"x_acc,y_acc,z_acc,x_gyro,y_gyro,z_gyro", "acc x,acc y,acc z,gyro x,gyro y,gyro z",
        "ax [m/s^2],ay,az,gx [rad/s],gy,gz"}) {
    const FlightLog log = Convert(fmt::format("t,{}\n", names), kImuRow);
    EXPECT_EQ(log.imu[0].accel.z(), -9.81) << map_;
    EXPECT_EQ(log.imu[0].gyro.z(), 0.5) << map_;
  }
}

TEST_F(Proposal, RatesOfAControllerAreNoAttitude) {
  const std::string names = fmt::format(
      "{},controller.r_roll[rad/s],controller.r_pitch[rad/s],controller.r_yaw[rad/s],"
      "controller.roll[deg],controller.pitch[deg],controller.yaw[deg]\n",
      kImuNames);
  EXPECT_TRUE(Convert(names, std::string(kImuRow) + ",0,0,0,0,0,0").attitude.empty()) << map_;
}

TEST_F(Proposal, VectorsHaveManyNames) {
  for (const char* names : {"N,E,D", "pn,pe,pd", "north,east,down", "PosN,PosE,PosD",
                            "vicon_x,vicon_y,vicon_z", "gt_x,gt_y,gt_z"}) {
    const FlightLog log = Beside(std::string(",") + names, ",1,2,3");
    ASSERT_EQ(log.fixes.size(), 3U) << map_;
    EXPECT_EQ(log.fixes[0].p_E, Eigen::Vector3d(1, 2, 3)) << map_;
  }
  const FlightLog up = Beside(",east,north,up", ",2,1,-3");
  ASSERT_EQ(up.fixes.size(), 3U) << map_;
  EXPECT_EQ(up.fixes[0].p_E, Eigen::Vector3d(1, 2, 3)) << map_;
  for (const char* rates : {"roll_rate,pitch_rate,yaw_rate", "rollspeed,pitchspeed,yawspeed",
                            "xgyro,ygyro,zgyro", "p,q,r", "w_x,w_y,w_z", "wx,wy,wz"}) {
    const FlightLog log = Convert(fmt::format("t,xacc,yacc,zacc,{}\n", rates), kImuRow);
    EXPECT_EQ(log.imu[0].gyro.z(), 0.5) << map_;
    EXPECT_EQ(log.imu[0].accel.z(), -9.81) << map_;
  }
}

TEST_F(Proposal, NamesMayBeOfOtherLanguagesAndLatin1) {
  for (const char* names :
       {"Zeit,Beschleunigung_x,Beschleunigung_y,Beschleunigung_z,Drehrate_x,Drehrate_y,Drehrate_z,"
        "Rollwinkel,Nickwinkel,Gierwinkel,Ort_x,Ort_y,Ort_z",
        "temps,Acc\xE9l\xE9ration x,Acc\xE9l\xE9ration y,Acc\xE9l\xE9ration z,vitesse_angulaire_x,"
        "vitesse_angulaire_y,vitesse_angulaire_z,roulis,tangage,lacet,position_x,position_y,"
        "position_z",
        "tiempo,aceleraci\xF3n_x,aceleraci\xF3n_y,aceleraci\xF3n_z,giroscopio_x,giroscopio_y,"
        "giroscopio_z,alabeo,cabeceo,gui\xF1"
        "ada,posicion_x,posicion_y,posicion_z"}) {
    const FlightLog log = Convert(std::string(names) + "\n", ",0,0,-9.81,0,0,0.5,0,0,1,1,2,3");
    EXPECT_EQ(log.imu[0].gyro.z(), 0.5) << map_;
    ASSERT_EQ(log.mocap.size(), 3U) << map_;
    EXPECT_NEAR(2 * std::asin(log.mocap[0].q_E.z()), 1.0, 1e-9) << map_;
    EXPECT_EQ(map_.find('\xE9'), std::string::npos);
  }
}

TEST_F(Proposal, TimesMayBeTicksOfNetOrFramesOfAStatedRate) {
  std::string ticks = std::string(kImuNames) + "\n",
              vicon = "Objects\n200\n,,cf" + std::string(6, ',');
  vicon += "\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ,\n,,rad,rad,rad,mm,mm,mm,\n";
  std::string qtm = "NO_OF_FRAMES\t9\nFREQUENCY\t200\nFrame\tX\tY\tZ\n";
  for (int i = 0; i < 9; ++i) {
    ticks += fmt::format("{}{}\n", 638'500'000'000'000'000 + 50'000 * i, kImuRow);
    vicon += fmt::format("{},0,0,0,1,1000,2000,3000,\n", i + 1);
    qtm += fmt::format("{}\t1\t2\t3\n", i + 1);
  }
  const auto last = [&](const std::string& text) {
    return OpenRecording(files_.Write("frames.csv", text))->channels().front().last;
  };
  EXPECT_EQ(last(ticks), 1'714'403'200'040'000'000);
  EXPECT_EQ(last(vicon), 40'000'000);
  EXPECT_EQ(last(qtm), 40'000'000);
  EXPECT_THAT(ProposeMap(OpenRecording(files_.Write("frames.csv", vicon)).get()),
              HasSubstr("\"TZ\"], unit: mm}, euler: {roll: \"RX\""));
}

// The map of a Crazyflie's own columns does not shut out those of a tracker.
TEST_F(Proposal, ColumnsOfATrackerJoinAMapThatShips) {
  std::string csv =
      "Timestamp,acc.x,acc.y,acc.z,gyro.x,gyro.y,gyro.z,stateEstimate.x,stateEstimate.y,"
      "stateEstimate.z,vicon_x,vicon_y,vicon_z,vicon_qw,vicon_qx,vicon_qy,vicon_qz\n";
  for (int i = 0; i < 99; ++i) csv += fmt::format("{},0,0,1,0,0,9,9,9,9,1,2,3,1,0,0,0\n", 10 * i);
  const FoundLog found = FindLog({files_.Write("cf.csv", csv)});
  const FlightLog log = ConvertFound(found, {});
  ASSERT_EQ(log.mocap.size(), 99U) << found.map;
  EXPECT_EQ(log.mocap[0].p_E, Eigen::Vector3d(1, -2, -3));
  EXPECT_EQ(log.attitude.size(), 99U);
  EXPECT_NEAR(log.imu[0].accel.z(), -9.80665, 1e-9);
}

TEST_F(Proposal, AnglesInDegreesAreToldByAnyOfThem) {
  const FlightLog log = Beside(",roll,pitch,yaw", ",0,3,0");
  EXPECT_NEAR(2 * std::asin(log.attitude[0].q_Ep_I.y()), 3 * M_PI / 180, 1e-9) << map_;
}

TEST_F(Proposal, ALineOfUnitsMayHaveUnitsOfOthers) {
  const FlightLog log = Convert(
      std::string(kImuNames) + ",vx,vy,vz,load\ns,g,g,g,deg/s,deg/s,deg/s,m/s,m/s,m/s,furlong\n",
      ",0,0,-1,0,0,90,1,0,0,0.5");
  ASSERT_EQ(log.imu.size(), 3U) << map_;
  EXPECT_NEAR(log.imu[0].gyro.z(), M_PI / 2, 1e-12) << map_;
  EXPECT_EQ(log.fixes.size(), 3U) << map_;
}

TEST_F(Proposal, DurationsAndSlashedDatesAreTimes) {
  std::string csv = std::string(kImuNames) + "\n";
  for (const char* t : {"0 sec", "0.01 sec", "0.02 sec"}) csv += std::string(t) + kImuRow + "\n";
  const std::string file = files_.Write("matlab.csv", csv);
  const FlightLog log = ConvertLog(
      ReadImportMap(files_.Write("map.yaml", ProposeMap(OpenRecording(file).get()))), {file}, {});
  ASSERT_EQ(log.imu.size(), 3U);
  EXPECT_EQ(log.imu[2].t - log.imu[0].t, 20'000'000);
}

// Of a clock that starts again the longest part is kept, as of recordings.
TEST_F(Proposal, ARestartIsCutOff) {
  std::string csv = std::string(kImuNames) + "\n";
  for (int i = 0; i < 1000; ++i) csv += fmt::format("{}{}\n", 0.01 * i, kImuRow);
  for (int i = 0; i < 700; ++i) csv += fmt::format("{}{}\n", 0.01 * i, kImuRow);
  const std::string file = files_.Write("restart.csv", csv);
  const FlightLog log = ConvertLog(
      ReadImportMap(files_.Write("map.yaml", ProposeMap(OpenRecording(file).get()))), {file}, {});
  EXPECT_EQ(log.imu.size(), 1000U);
  EXPECT_THAT(log.warnings, Contains(HasSubstr("as after a restart")));
}

// The parts of a clock that starts again lower do not overlap. Chunks of a bag may stand so, rows
// of tables that were made of one may not.
TEST_F(Proposal, ARestartInTablesOfABagIsSaid) {
  std::string imu =
      "timestamp_ns,linear_acceleration.x,linear_acceleration.y,linear_acceleration.z,"
      "angular_velocity.x,angular_velocity.y,angular_velocity.z\n";
  std::string places = "timestamp_ns,position.x,position.y,position.z\n";
  for (int i = 0; i < 1000; ++i) {
    const long long t = (i < 600 ? 43'000 + i : i) * 10'000'000LL;
    imu += fmt::format("{}{}\n", t, kImuRow);
    places += fmt::format("{},{},0.5,-1\n", t, 0.01 * i);
  }
  FoundLog found = FindLog({files_.Write("imu.csv", imu), files_.Write("position.csv", places)});
  ASSERT_STREQ(found.recording->format().key, "ros2");
  EXPECT_THAT(ConvertFound(found, {}).warnings, Contains(HasSubstr("put in the order of time")));
}

// The error is about the IMU that is missing, not about the map's syntax.
TEST_F(Proposal, WithoutAStreamIsStillAMap) {
  EXPECT_THAT(ErrorOf([&] { Convert("t,a\n", ",1"); }), HasSubstr("streams.imu"));
}

TEST_F(Proposal, ATrajectoryHasPositions) {
  const std::string file = files_.Write("a.txt", "1.0 1 2 3 0 0 0 1\n1.1 1 2 3 0 0 0 1\n");
  EXPECT_THAT(ProposeMap(OpenRecording(file).get()),
              HasSubstr("position: {columns: [\"tx\", \"ty\", \"tz\"], unit: m}, quaternion: {w: "
                        "\"qw\""));
}

}  // namespace
}  // namespace trueline
