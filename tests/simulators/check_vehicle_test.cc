// Files of simulators: their numbers with places, what is refused, and what a file tells of itself.
#include <fstream>
#include <regex>

#include "problems/simulators/audit.h"
#include "problems/simulators/export_vehicle.h"
#include "tests/common/test_files.h"
#include "tests/simulators/made_vehicle.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

ParameterFile Parsed(const std::string& name, const std::string& text) {
  return ParameterFile::Parse(name, text);
}

// The text at the place of a leaf is the leaf's.
void ExpectPlace(const ParameterFile& file, const std::string& where, const std::string& text,
                 int line) {
  const FileNode* leaf = file.Find(where);
  ASSERT_NE(leaf, nullptr) << where;
  EXPECT_EQ(leaf->text, text);
  EXPECT_EQ(file.text().substr(leaf->place.begin, leaf->place.end - leaf->place.begin), text);
  EXPECT_EQ(leaf->place.line, line);
}

TEST(ParameterFile, FindsNumbersWithTheirBytes) {
  ExpectPlace(Parsed("a.yaml", "# \xC3\xA4\nb:\n  c: [1.0, 2e-3]  # x\n"), "b/c/1", "2e-3", 3);
  ExpectPlace(Parsed("a.toml", "# \xC3\xA4\n[b]\nc = [[1.0, 2e-3],\n [3.0, 4.0]]\n"), "b/c/0/1",
              "2e-3", 3);
  const std::string xml =
      "<?xml version=\"1.0\"?>\n<r>\n <l name='a' m = \"7\"><p> 1 2\n 3</p></l>\n <l "
      "name='b'/>\n</r>";
  ExpectPlace(Parsed("a.sdf", xml), "r/l[name=a]/p/2", "3", 4);
  ExpectPlace(Parsed("a.sdf", xml), "//l/@m", "7", 3);
  EXPECT_EQ(Parsed("a.sdf", xml).Find("r/l[name=c]"), nullptr);
  ExpectPlace(Parsed("10040", "#!/bin/sh\nparam set-default SIH_MASS 1.5 # kg\n"), "SIH_MASS",
              "1.5", 2);
  ExpectPlace(Parsed("a.params", "# x\n1\t1\tSIH_MASS\t1.5\t9\n"), "SIH_MASS", "1.5", 2);
}

// What is legal and rare: anchors, merged maps, quotes, CDATA, entities, a parameter set twice.
TEST(ParameterFile, ReadsWhatIsRareButLegal) {
  const std::string yaml =
      "base: &base {m: 1.5, k: 2.0}\r\nown:\r\n  <<: *base\r\n  k: &k !!float 3.0\r\n  q: "
      "'4.0'\r\n";
  ExpectPlace(Parsed("a.yaml", yaml), "own/m", "1.5", 1);
  ExpectPlace(Parsed("a.yaml", yaml), "own/k", "3.0", 4);
  ExpectPlace(Parsed("a.yaml", yaml), "own/q", "4.0", 5);
  EXPECT_THAT(ErrorOf([] { Parsed("a.yaml", "a: 1\na: 2\n"); }), HasSubstr("'a' is stated twice"));
  const std::string xml = "<r>\n<m><![CDATA[1.5]]></m><n>&#49;.5</n><o>1<!-- kg --></o></r>";
  const ParameterFile file = Parsed("a.sdf", xml);
  ExpectPlace(file, "r/m", "1.5", 2);
  EXPECT_DOUBLE_EQ(file.NumberOf(*file.Find("r/n")), 1.5);
  EXPECT_EQ(file.PlainNumber(*file.Find("r/n")), nullptr) << "its bytes are others";
  ExpectPlace(file, "r/o", "1", 2);
  ExpectPlace(Parsed("10040", "param set SIH_MASS 1\r\nparam set SIH_MASS 2\r\n"), "SIH_MASS", "2",
              2);
  const std::string toml = "cf.mass = 0.03\r\ncf.rpm2thrust = [0, 0, 2.5e-10]\r\n";
  ExpectPlace(Parsed("a.toml", toml), "cf/rpm2thrust/2", "2.5e-10", 2);
}

TEST(ParameterFile, ReadsProgramCode) {
  const std::string python =
      "# mass = 7\n\"\"\"mass = 8\"\"\"\nX = Cfg(\n  mass=1.5,  # kg\n  rows=[[1.0, -2e-3], "
      "[d, 4.0]],\n  box={\"side\": np.array([5.0, 6.0])},\n  most: int = 9)\n";
  ExpectPlace(Parsed("a.py", python), "//mass", "1.5", 4);
  ExpectPlace(Parsed("a.py", python), "X/rows/0/1", "-2e-3", 5);
  ExpectPlace(Parsed("a.py", python), "rows/1/1", "4.0", 5);
  ExpectPlace(Parsed("a.py", python), "//box/side/1", "6.0", 6);
  ExpectPlace(Parsed("a.py", python), "//most", "9", 7);
  const std::string c =
      "/* k = 1; */\nvoid Set(Params& p) {\n  p.motor.k = 2.5f;  // N\n  p.box.x() = 0.25;\n"
      "  const Vector3r place = Vector3r(0.1f, -0.2f, d);\n  if (p.k == 3) return;\n}\n";
  ExpectPlace(Parsed("a.hpp", c), "//k", "2.5", 3);
  ExpectPlace(Parsed("a.hpp", c), "//box.x", "0.25", 4);
  ExpectPlace(Parsed("a.hpp", c), "//place/1", "-0.2", 5);
  const ParameterFile code = Parsed("a.hpp", c);
  EXPECT_THAT(ErrorOf([&] { code.NumberOf(*code.Find("//place/2")); }), HasSubstr("a.hpp:5"));
  EXPECT_THAT(ErrorOf([] { Parsed("a.py", std::string(1000, '(')); }), HasSubstr("too deeply"));
  // Text that ends anywhere is read as far as it goes.
  for (std::size_t length = 1; length < python.size(); ++length) {
    ErrorOf([&] { Parsed("a.py", python.substr(0, length)); });
    ErrorOf([&] { Parsed("a.hpp", c.substr(0, std::min(length, c.size()))); });
  }
}

TEST(ParameterFile, ComputesXacro) {
  const ParameterFile file = Parsed("a.xacro",
                                    "<robot><xacro:property name=\"arm\" value=\"0.5\"/>\n"
                                    "<o xyz=\"-${arm} ${2 * (arm - 0.1)} ${arm}\" bad=\"${other}\" "
                                    "loop=\"${list[0]}\"/></robot>");
  EXPECT_DOUBLE_EQ(file.NumberOf(*file.Find("//o/@xyz/0")), -0.5);
  EXPECT_DOUBLE_EQ(file.NumberOf(*file.Find("//o/@xyz/1")), 0.8);
  EXPECT_EQ(file.PlainNumber(*file.Find("//o/@xyz/1")), nullptr);
  EXPECT_EQ(file.PlainNumber(*file.Find("//o/@xyz/2"))->text, "0.5");
  EXPECT_THAT(ErrorOf([&] { file.NumberOf(*file.Find("//o/@bad")); }), HasSubstr("a.xacro:2"));
  EXPECT_THAT(ErrorOf([&] { file.NumberOf(*file.Find("//o/@loop")); }), HasSubstr("list"));
}

TEST(ParameterFile, RefusesWhatIsNoNumber) {
  const ParameterFile file =
      Parsed("a.sdf", "<sdf>\n<k>0.000000002*70</k><n>{{ mass }}</n><h>0x10</h><i>nan</i></sdf>");
  EXPECT_THAT(ErrorOf([&] { file.NumberOf(*file.Find("sdf/k")); }),
              AllOf(HasSubstr("a.sdf:2"), HasSubstr("'k'"), HasSubstr("write 1.4e-07")));
  for (const char* name : {"sdf/n", "sdf/h", "sdf/i"}) {
    EXPECT_THAT(ErrorOf([&] { file.NumberOf(*file.Find(name)); }), HasSubstr("is no number"));
  }
  EXPECT_THAT(ErrorOf([] { Parsed("a.sdf", "<sdf>\n<a></b></sdf>"); }), HasSubstr("a.sdf:2"));
  EXPECT_THAT(ErrorOf([] { Parsed("a.yaml", "a: [1,\n"); }), HasSubstr("YAML"));
  EXPECT_THAT(ErrorOf([] { Parsed("a.toml", "a = \n"); }), HasSubstr("a.toml:1"));
  EXPECT_THAT(ErrorOf([] { Parsed("a.yaml", "  \n"); }), HasSubstr("empty"));
  EXPECT_THAT(ErrorOf([] { Parsed("a.py", "a.mass = 1\nb.mass = 2"); }),
              HasSubstr("'mass' is 2 here and 1 in line 1"));
  EXPECT_THAT(ErrorOf([] { ParameterFile::Read("none.sdf"); }), HasSubstr("can't be read"));
}

class FileChecks : public MadeFile {
 protected:
  // In the file of a vehicle that was changed.
  template <class Change>
  std::vector<std::string> Named(const std::string& to, const Change& change) {
    NeutralVehicle vehicle = Vehicle();
    change(vehicle);
    return Names(AuditFiles(Files(Export(vehicle, to))));
  }
  // Of the good vehicle's file with one number changed: it alone is named, with its line.
  Audit Damaged(const std::string& to, const std::string& number, const std::string& wrong,
                const std::string& named) {
    const Audit audit = AuditFiles(Files(Replaced(Export(Vehicle(), to), number, wrong)));
    EXPECT_THAT(Names(audit), ElementsAre(named)) << to << wrong;
    for (const Contradicted& entry : audit.contradicted) EXPECT_GT(entry.line, 0);
    return audit;
  }
  static NeutralVehicle Vehicle() {
    NeutralVehicle v = MadeQuadrotor();
    for (const char* axis : {"K_x", "K_y", "K_z"}) v.body[axis] = -0.3;
    v.body["tau"] = 0.03, v.body["full_speed"] = 2200.0;
    return v;
  }
};

// Links that joints turn are the rotors of a model whose motors stand elsewhere.
TEST_F(FileChecks, AModelWithoutMotorsHasAnArm) {
  const auto without_motors = [&](const NeutralVehicle& v) {
    std::string text = Export(v, "gz");
    const std::string end = "</plugin>";
    for (std::size_t at; (at = text.find("<plugin")) != std::string::npos;) {
      text.erase(at, text.find(end, at) + end.size() - at);
    }
    return AuditFiles(Files(text)).contradicted;
  };
  EXPECT_THAT(without_motors(Vehicle()), IsEmpty());
  NeutralVehicle v = Vehicle();
  v.body["m"] *= 50.0;
  ASSERT_FALSE(without_motors(v).empty());
  EXPECT_EQ(without_motors(v).front().parameter, "m");
}

// A centre of mass that one file has elsewhere between the rotors.
TEST_F(FileChecks, CompareTheCentreOfMass) {
  NeutralVehicle v = Vehicle();
  Export(v, "gz");
  const fs::path first = folder_ / "first.sdf";
  fs::rename(path_, first);
  v.body["r_BM_z"] = -0.02;
  Export(v, "gz");
  const std::vector<VehicleFile> files = ReadVehicleFiles({first.string(), path_.string()});
  const std::vector<Contradicted> findings = CompareVehicles(files);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].parameter, "r_BM_z");
  EXPECT_NEAR(findings[0].file_value, -0.02, 1e-3);
}

void ScaleThrust(NeutralVehicle& v, double factor) {
  for (Numbers& rotor : v.rotors) rotor["k_f"] *= factor;
}
void ScaleDragMoment(NeutralVehicle& v, double factor) {
  for (Numbers& rotor : v.rotors) rotor["k_m"] *= factor;
}

TEST_F(FileChecks, NameWhatNoVehicleHas) {
  EXPECT_THAT(Named("gz", [](NeutralVehicle&) {}), IsEmpty());
  // A mass ten times too large makes inertia, hover and drag look wrong: the mass alone is named.
  EXPECT_THAT(Named("gz", [](auto& v) { v.body["m"] *= 10.0; }), ElementsAre("m"));
  EXPECT_THAT(Named("crazyflow", [](auto& v) { v.body["m"] *= 10.0; }), Contains("m"));
  // A thrust in another unit, alone.
  EXPECT_THAT(Named("rotorpy", [](auto& v) { ScaleThrust(v, 1.0 / 91.189); }), ElementsAre("k_f"));
  // Consequences of a mass or thrust that is usual for the arm are not named, but it is.
  EXPECT_THAT(Named("gz", [](auto& v) { v.body["m"] *= 6.0; }), ElementsAre("m"));
  EXPECT_THAT(Named("crazyflow", [](auto& v) { ScaleThrust(v, 0.1); }), ElementsAre("k_f"));
  // The inertia of a solid as large as the vehicle, with its mass: no axis can have it.
  const auto solid = [](auto& v) {
    for (const char* axis : {"I_x", "I_y", "I_z"}) v.body[axis] *= 5.0;
  };
  EXPECT_THAT(Named("gym_pybullet_drones", solid), UnorderedElementsAre("I_x", "I_y", "I_z"));
  EXPECT_THAT(Named("gz", [](auto& v) { std::swap(v.body["I_x"], v.body["I_z"]); }),
              ElementsAre("I_z"));
  // More than I_x + I_y.
  EXPECT_THAT(Named("gz", [](auto& v) { v.body["I_z"] = 1.6e-3; }), Contains("I_z"));
  EXPECT_THAT(Named("rotorpy", [](auto& v) { v.body["tau"] = 0.002; }), Contains("tau"));
  EXPECT_THAT(Named("flightmare", [](auto& v) { v.body["tau"] = 25.0; }), Contains("tau"));  // 1/s
  EXPECT_THAT(Named("gz", [](auto& v) { ScaleDragMoment(v, 16.0); }), Contains("k_m"));
  const auto in_rpm = [](auto& v) { ScaleThrust(v, 91.19), ScaleDragMoment(v, 91.19); };
  EXPECT_THAT(Named("flightmare", in_rpm), Contains("k_f"));
  EXPECT_THAT(Named("crazyflow", [](auto& v) { v.body["K_x"] = v.body["K_y"] = 0.3; }),
              Contains("K_x"));
  EXPECT_THAT(Named("rotorpy", [](auto& v) { v.body["full_speed"] = 1300.0; }),
              Contains("full_speed"));
  EXPECT_THAT(Named("gz", [](auto& v) { v.rotors[0]["spin"] = 1.0; }), Contains("spin"));
}

// Drag, damping and inertia that push the vehicle on.
TEST_F(FileChecks, NumbersOfTheWrongSignAreNamed) {
  Damaged("pyflyt", "drag_coef_pqr: 0.0", "drag_coef_pqr: -1.0e-4", "quadratic_damping");
  Damaged("px4_sih", "SIH_KDW 0.0", "SIH_KDW -0.025", "damping");
  Damaged("crazyflow", "prop_inertia = 0.0", "prop_inertia = -3.0e-8", "J_r");
  Damaged("rotorpy", "k_d: ", "k_d: -", "rotor_speed_drag");
}

// Zero is as impossible as less of what makes a vehicle.
TEST_F(FileChecks, NumbersThatMustBePositiveAreNamed) {
  struct Case {
    const char *to, *number, *wrong, *named;
  };
  for (const auto& [to, number, wrong, named] :
       std::vector<Case>{{"rotorpy", "mass: ", "mass: 0 # ", "m"},
                         {"rotorpy", "mass: ", "mass: -", "m"},
                         {"rotorpy", "k_eta: ", "k_eta: 0 # ", "k_f"},
                         {"rotorpy", "k_m: ", "k_m: 0 # ", "k_m"},
                         {"rotorpy", "Ixx: ", "Ixx: 0 # ", "I_x"},
                         {"gz", "<motorConstant>", "<motorConstant>-", "k_f"}}) {
    const Audit audit = Damaged(to, number, wrong, named);
    ASSERT_FALSE(audit.contradicted.empty());
    EXPECT_EQ(audit.contradicted[0].text, "must be positive");
    EXPECT_THAT(audit.not_judged, Not(Contains(testing::Field(&NotJudged::parameter, named))));
  }
}

TEST_F(FileChecks, AModelWithoutMassIsNoVehicle) {
  path_ = folder_ / "empty.sdf";
  const auto model = [&](const std::string& link) {
    return AuditFiles(Files("<sdf><model><link name='a'>" + link + "</link></model></sdf>"));
  };
  EXPECT_THAT(ErrorOf([&] { model(""); }), HasSubstr("states no mass, inertia, place or thrust"));
  const Audit audit = model("<inertial><mass>0</mass></inertial>");
  ASSERT_EQ(audit.contradicted.size(), 1U);
  EXPECT_EQ(audit.contradicted[0].text, "must be positive");
}

TEST_F(FileChecks, RefuseAPoseInAnotherFrame) {
  path_ = folder_ / "frames.sdf";
  std::ofstream(path_) << "<sdf><model><link name='a'>\n<pose relative_to='b'>1 0 0 0 0 0</pose>"
                          "<inertial><mass>1</mass></inertial></link></model></sdf>";
  EXPECT_THAT(ErrorOf([&] { ReadVehicleFiles({path_.string()}); }),
              AllOf(HasSubstr("frames.sdf:2"), HasSubstr("relative_to='b'")));
}

TEST_F(FileChecks, NameAnArmThatIsNotThatOfTheRotors) {
  std::string text = Export(Vehicle(), "gym_pybullet_drones");
  const std::size_t at = text.find("arm=\"");
  text.replace(at, text.find('"', at + 5) - at, "arm=\"0.2");
  const Audit audit = AuditFiles(Files(text));
  ASSERT_EQ(audit.contradicted.size(), 1U);
  EXPECT_EQ(audit.contradicted[0].parameter, "arm");
  EXPECT_GT(audit.contradicted[0].line, 0);
}

// Rotors that stand left for right to the order of the simulator's code turn the wrong way, but for
// the one vehicle for which the code turns them.
TEST_F(FileChecks, NameRotorsInAnotherOrderThanTheCodes) {
  const auto mirrored = [&](const char* name) {
    std::string text = Export(Vehicle(), "gym_pybullet_drones");
    for (const auto& [from, to] : {std::pair{"prop0_link", "other"},
                                   {"prop3_link", "prop0_link"},
                                   {"other", "prop3_link"},
                                   {"prop1_link", "other"},
                                   {"prop2_link", "prop1_link"},
                                   {"other", "prop2_link"},
                                   {"robot name=\"vehicle", name}}) {
      text = std::regex_replace(text, std::regex(from), to);
    }
    return AuditFiles(Files(text)).contradicted;
  };
  const std::vector<Contradicted> found = mirrored("robot name=\"cf2");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].text, HasSubstr("rotor 0 stands elsewhere than the simulator's code"));
  EXPECT_THAT(mirrored("robot name=\"racer"), IsEmpty());
}

TEST_F(FileChecks, NameFilesThatDisagree) {
  NeutralVehicle other = Vehicle();
  other.body["m"] = 0.26;
  Export(Vehicle(), "rotorpy");
  fs::rename(path_, folder_ / "b.yaml");
  Export(other, "flightmare");
  const Audit audit = AuditFiles(ReadVehicleFiles({(folder_ / "b.yaml").string(), path_.string()}));
  // The drag by mass differs as a consequence only.
  ASSERT_EQ(audit.contradicted.size(), 1U);
  EXPECT_EQ(audit.contradicted[0].parameter, "m");
  EXPECT_THAT(audit.contradicted[0].text, HasSubstr("b.yaml"));
}

// The files that simulators ship, where they are at hand: those that are right have no fault, those
// with an error that a file can tell name it.
class ShippedFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = DataFolder().parent_path() / "simulators";
    if (!fs::exists(folder_)) GTEST_SKIP() << folder_ << " is not there";
  }
  std::vector<std::string> Named(const std::vector<std::string>& files) const {
    std::vector<std::string> paths;
    for (const std::string& file : files) paths.push_back((folder_ / file).string());
    return Names(AuditFiles(ReadVehicleFiles(paths)));
  }
  fs::path folder_;
};

TEST_F(ShippedFiles, RightOnesHaveNoFault) {
  for (const std::vector<std::string>& files : std::vector<std::vector<std::string>>{
           {"rotorpy/crazyflie_params.yaml"},
           {"rotorpy/crazyfliebrushless_params.yaml"},
           {"rotorpy/px4_sihsim_quadx_params.yaml"},
           {"px4_gazebo_classic/iris.sdf.jinja"},
           {"px4_gazebo/x500.sdf", "px4_gazebo/x500_base.sdf"},
           {"px4_sih/sih_params_multicopter.yaml"},
           {"gym_pybullet_drones/cf2x.urdf"},
           {"gym_pybullet_drones/cf2p.urdf"},
           {"drone_models_crazyflow/crazyflow_first_principles_params.toml"},
           {"flightmare/control_config_dev.yaml"},
           {"rotors/hummingbird.xacro", "rotors/hummingbird.yaml"},
           {"rotors/pelican.xacro", "rotors/pelican.yaml"},
           {"crazys/crazyflie2_forster.xacro"},
           {"mrs/x500.yaml"},
           {"mrs/f450.yaml"},
           {"mujoco_menagerie/cf2.xml"},
           {"aerial_gym/quad.urdf"},
           {"aerostack2/crazyflie_corrected.sdf"}}) {
    EXPECT_THAT(Named(files), IsEmpty()) << files[0];
  }
}

TEST_F(ShippedFiles, ErrorsThatAFileTellsAreNamed) {
  EXPECT_THAT(Named({"px4_gazebo_classic/errors/iris_inertia_wrong.sdf.jinja"}), Contains("I_z"));
  EXPECT_THAT(Named({"px4_gazebo_classic/errors/iris_moment_constant_wrong.sdf.jinja"}),
              Contains("k_m"));
  EXPECT_THAT(Named({"rotorpy/errors/crazyflie_params_tau_wrong.yaml"}), Contains("tau"));
  EXPECT_THAT(Named({"crazys/errors/crazyflie2_mass_wrong.xacro"}), Contains("m"));
  EXPECT_THAT(Named({"crazys/crazyflie2.xacro"}), Contains("rotor_speed_drag"));
  EXPECT_THAT(Named({"drone_models_crazyflow/drone_models_params.toml",
                     "drone_models_crazyflow/crazyflow_first_principles_params.toml"}),
              UnorderedElementsAre("m", "I_x", "I_y"));
}

}  // namespace
}  // namespace trueline
