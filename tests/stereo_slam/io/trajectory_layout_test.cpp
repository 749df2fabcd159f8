// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "stereo_slam/io/table_row.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

Trajectory read_as_file(const std::string& text, std::optional<TrajectoryFormat> format = std::nullopt) {
  const TemporaryFolder folder;
  write_text(folder / "t.txt", text);
  return read_trajectory(folder / "t.txt", format);
}

std::string refusal(const std::string& text, std::optional<TrajectoryFormat> format = std::nullopt) {
  return message_of([&] { (void)read_as_file(text, format); });
}

constexpr std::int64_t kStart_ns = 1'403'636'579'763'555'584;
constexpr std::int64_t kStep_ns = 50'000'000;

/// A pose of the test path, with all its components different.
struct Row {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d p;
  Eigen::Quaterniond q;
};

std::vector<Row> path() {
  std::vector<Row> rows;
  for (int i = 0; i < 5; ++i) {
    rows.push_back({kStart_ns + i * kStep_ns,
                    {0.5 + 0.1 * i, -2.0 - 0.2 * i, 3.25},
                    Eigen::Quaterniond(0.1 - 0.02 * i, 0.5, -0.7, 0.4 + 0.01 * i).normalized()});
  }
  return rows;
}

/// The path as a text, with `head` before it.
template <class Write>
std::string text_of(const std::string& head, const Write& write, const std::string& line_end = "\n") {
  std::string text = head.empty() ? "" : head + line_end;
  for (const Row& row : path()) text += write(row) + line_end;
  return text;
}

std::string joined(const std::vector<double>& numbers, const std::string& separator) {
  std::vector<std::string> fields;
  for (const double number : numbers) fields.push_back(fmt::format("{:.15g}", number));
  return fmt::format("{}", fmt::join(fields, separator));
}

std::string position(const Row& row, const std::string& separator = ",") {
  return joined({row.p.x(), row.p.y(), row.p.z()}, separator);
}

std::string xyzw(const Row& row, const std::string& separator = ",") {
  return joined({row.q.x(), row.q.y(), row.q.z(), row.q.w()}, separator);
}

std::string wxyz(const Row& row, const std::string& separator = ",") {
  return joined({row.q.w(), row.q.x(), row.q.y(), row.q.z()}, separator);
}

std::vector<double> matrix(const Row& row) {
  const Eigen::Matrix3d R = row.q.toRotationMatrix();
  std::vector<double> numbers;
  for (int i = 0; i < 3; ++i) numbers.insert(numbers.end(), {R(i, 0), R(i, 1), R(i, 2), row.p[i]});
  return numbers;
}

void check_poses(const Trajectory& read) {
  const auto rows = path();
  REQUIRE(read.poses.size() == rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {  // numbers are written with 15 digits
    CHECK((read.poses[i].translation() - rows[i].p).norm() < 1e-13);
    CHECK((read.poses[i].linear() - rows[i].q.toRotationMatrix()).norm() < 1e-13);
  }
}

/// Checks poses and stamps; stamps in seconds with nine digits lose nothing.
void check_path(const Trajectory& read, std::int64_t tolerance_ns = 0) {
  check_poses(read);
  REQUIRE(read.stamps_ns.size() == read.poses.size());
  for (std::size_t i = 0; i < read.poses.size(); ++i)
    CHECK(std::abs(read.stamps_ns[i] - path()[i].stamp_ns) <= tolerance_ns);
}

std::string seconds(const Row& row) { return format_seconds(row.stamp_ns); }

std::string tum_names(const std::string& separator) {
  return fmt::format("{}", fmt::join({"timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"}, separator));
}

}  // namespace

TEST_CASE("Columns are found by their names, in the spellings of other programs", "[trajectory_layout]") {
  const auto tum = [](const Row& r) { return seconds(r) + "," + position(r) + "," + xyzw(r); };
  const auto euroc = [](const Row& r) {
    return fmt::format("{},{},{},1,2,3", r.stamp_ns, position(r), wxyz(r));
  };
  check_path(read_as_file(text_of(tum_names(","), tum)));
  check_path(read_as_file(text_of("#" + tum_names(", "), tum)));
  check_path(read_as_file(text_of(R"("t","px","py","pz","qx","qy","qz","qw")", tum)));
  check_path(read_as_file(text_of("time [s],x [m],y [m],z [m],q_x [],q_y [],q_z [],q_w []", tum)));
  check_path(read_as_file(text_of("time,PosX,PosY,PosZ,QuatX,QuatY,QuatZ,QuatW", tum)));
  check_path(
      read_as_file(text_of("__time,/odom/pose/pose/position/x,/odom/pose/pose/position/y,"
                           "/odom/pose/pose/position/z,/odom/pose/pose/orientation/x,"
                           "/odom/pose/pose/orientation/y,/odom/pose/pose/orientation/z,"
                           "/odom/pose/pose/orientation/w",
                           tum)));
  check_path(
      read_as_file(text_of("#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], "
                           "q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], b_w_RS_S_x [rad s^-1], "
                           "b_a_RS_S_y [m s^-2]",
                           euroc)));
}

TEST_CASE("Columns may be in any order, between any separators, with others between them",
          "[trajectory_layout]") {
  check_path(read_as_file(text_of("qw;qx;qy;qz;x;y;z;time", [](const Row& r) {
    return wxyz(r, ";") + ";" + position(r, ";") + ";" + seconds(r);
  })));
  check_path(read_as_file(
      text_of("time stamp\tpos x\tpos y\tpos z\tquat w\tquat x\tquat y\tquat z",
              [](const Row& r) { return seconds(r) + "\t" + position(r, "\t") + "\t" + wxyz(r, "\t"); })));
  check_path(read_as_file(text_of("# timestamp tx ty tz qw qx qy qz", [](const Row& r) {
    return seconds(r) + " " + position(r, " ") + " " + wxyz(r, " ");
  })));
  check_path(read_as_file(text_of(",stamp,x,y,z,qx,qy,qz,qw,frame", [](const Row& r) {  // pandas
    return fmt::format("7,{},{},{},\"a, b\"", seconds(r), position(r), xyzw(r));
  })));
}

TEST_CASE("A message's own stamp is preferred to the time of its recording", "[trajectory_layout]") {
  check_path(read_as_file(text_of(
      "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,"
      "field.pose.position.y,field.pose.position.z,field.pose.orientation.x,field.pose.orientation.y,"
      "field.pose.orientation.z,field.pose.orientation.w",
      [](const Row& r) {
        return fmt::format("{},1,{},,{},{}", r.stamp_ns + 7'000'000, r.stamp_ns, position(r), xyzw(r));
      })));
  check_path(read_as_file(
      text_of("Time,header.seq,header.stamp.secs,header.stamp.nsecs,header.frame_id,pose.pose.position.x,"
              "pose.pose.position.y,pose.pose.position.z,pose.pose.orientation.x,pose.pose.orientation.y,"
              "pose.pose.orientation.z,pose.pose.orientation.w,pose.covariance0,twist.twist.linear.x,"
              "twist.twist.angular.x",
              [](const Row& r) {
                return fmt::format("1,2,{},{},map,{},{},9,9,9", r.stamp_ns / 1'000'000'000,
                                   r.stamp_ns % 1'000'000'000, position(r), xyzw(r));
              })));
}

TEST_CASE("Carriage returns, a byte order mark and comments do not matter", "[trajectory_layout]") {
  const auto row = [](const Row& r) { return seconds(r) + "," + position(r) + "," + xyzw(r); };
  check_path(read_as_file(text_of("\xEF\xBB\xBF" + tum_names(","), row, "\r\n")));
  check_path(read_as_file(
      text_of("# ground truth\n# file: 'x.bag'\n# " + tum_names(" "),
              [](const Row& r) { return seconds(r) + " " + position(r, " ") + " " + xyzw(r, " "); }) +
      "% the end\n"));
}

TEST_CASE("Names that do not tell all columns are refused", "[trajectory_layout]") {
  const std::string row = "1,2,3,4,0,0,0,1\n";
  CHECK_THAT(refusal("t,x,y,z,a,b,c,d\n" + row),
             Catch::Contains("t.txt:1: no column is named 'qw'") && Catch::Contains("timestamp,tx,ty,tz"));
  CHECK_THAT(refusal("x,y,z,qx,qy,qz,qw,n\n" + row), Catch::Contains("no column is named 'stamp'"));
  CHECK_THAT(refusal("t,x,y,z,roll,pitch,yaw,n\n" + row), Catch::Contains("no column is named 'qw'"));
  CHECK_THAT(refusal("t,gt_x,gt_y,gt_z,est_x,qx,qy,qz,qw\n1,2,3,4,5,0,0,0,1\n"),
             Catch::Contains("t.txt:1: the columns 'gt_x' and 'est_x' may both be meant"));
  CHECK_THAT(refusal(tum_names(",") + "\n1,2,3,4,0,0,0,1,9\n"), Catch::Contains("8 names for the 9 columns"));
  CHECK_THAT(refusal("t,x,y,z,qx,qy,qz,qw\n" + row + "2,3,4,5,0,0,0\n"),
             Catch::Contains("t.txt:3: 7 fields, but the first row has 8"));
  CHECK_THAT(refusal("t,x,y,z,qx,qy,qz,qw\n" + row + "2,,4,5,0,0,0,1\n"),
             Catch::Contains("t.txt:3: '' is not a finite number"));
  CHECK_THAT(refusal("t,x,y,z,qx,qy,qz,qw\n"), Catch::Contains("contains no poses"));
  const auto remarks = read_as_file("# t, x, y, z, a, b, c, d\n" + row).remarks;
  REQUIRE(remarks.size() == 1);
  CHECK_THAT(remarks[0], Catch::Contains("its names of columns are ignored: no column is named 'qw'"));
}

TEST_CASE("The size of the stamps tells their unit", "[trajectory_layout]") {
  const auto with_stamp = [](const auto& stamp) {
    return [stamp](const Row& r) { return stamp(r) + " " + position(r, " ") + " " + xyzw(r, " "); };
  };
  const auto divided = [](int zeros) {
    return [zeros](const Row& r) {
      std::string text = std::to_string(r.stamp_ns);
      return text.insert(text.size() - static_cast<std::size_t>(zeros), ".");
    };
  };
  const auto plain = read_as_file(text_of("", with_stamp(divided(9))));
  CHECK(plain.remarks.empty());
  check_path(plain);
  check_path(read_as_file(text_of("", with_stamp(divided(6)))));
  check_path(read_as_file(text_of("", with_stamp(divided(3)))));
  const auto whole = read_as_file(text_of("", with_stamp(divided(0))));
  check_path(whole);
  CHECK(whole.remarks == std::vector<std::string>{"its stamps are taken as nanoseconds, by their size"});
  const auto exponent = [](const Row& r) {
    return fmt::format("{:.18e}", static_cast<long double>(r.stamp_ns));
  };
  check_path(read_as_file(text_of("", with_stamp(exponent))));
  for (const auto& [size_ns, unit] : std::vector<std::pair<std::int64_t, std::string>>{
           {1'000'000, "milliseconds"}, {1000, "microseconds"}, {1, "nanoseconds"}}) {
    CAPTURE(unit);  // from zero on
    const auto from_zero = [size = size_ns](const Row& r) {
      return std::to_string((r.stamp_ns - kStart_ns) / size);
    };
    const auto read = read_as_file(text_of("", with_stamp(from_zero)));
    CHECK(read.stamps_ns.back() == 4 * kStep_ns);
    CHECK(read.remarks == std::vector<std::string>{"its stamps are taken as " + unit + ", by their size"});
  }
}

TEST_CASE("A name's unit holds unless the stamps cannot have it", "[trajectory_layout]") {
  const auto rows = [](const char* stamps) {
    std::string text;
    for (const char stamp : std::string(stamps)) text += fmt::format("{},0,0,0,0,0,0,1\n", stamp);
    return text;
  };
  CHECK(read_as_file("t_ms,x,y,z,qx,qy,qz,qw\n" + rows("147")).stamps_ns[2] == 7'000'000);
  CHECK(read_as_file("time(s),x,y,z,qx,qy,qz,qw\n" + rows("147")).stamps_ns[2] == 7'000'000'000);
  const auto wrong = read_as_file("time [ns],x,y,z,qx,qy,qz,qw\n1403636579.5,0,0,0,0,0,0,1\n");
  CHECK(wrong.stamps_ns[0] == 1'403'636'579'500'000'000);
  CHECK(wrong.remarks.size() == 1);
}

TEST_CASE("Stamps that lost their digits are refused", "[trajectory_layout]") {
  std::string text;
  for (int i = 0; i < 5; ++i) text += fmt::format("1.467e+18 {} 0 0 0 0 0 1\n", i);
  CHECK_THAT(refusal(text),
             Catch::EndsWith("t.txt: 4 of 5 stamps are the same as the one before; write them with "
                             "more digits"));
}

TEST_CASE("More columns than a pose has are ignored with a remark", "[trajectory_layout]") {
  const auto read = read_as_file(text_of(
      "", [](const Row& r) { return seconds(r) + " " + position(r, " ") + " " + xyzw(r, " ") + " 0.5 7"; }));
  check_path(read);
  REQUIRE(read.remarks.size() == 1);
  CHECK_THAT(read.remarks[0], Catch::Contains("10 columns without names; the first 8"));
  check_path(read_as_file(text_of("", [](const Row& r) {  // as many numbers as a matrix has
    return seconds(r) + " " + position(r, " ") + " " + xyzw(r, " ") + " 0.5 7 1 1";
  })));
  check_path(read_as_file(text_of("", [](const Row& r) {  // VINS-Fusion
    return fmt::format("{},{},{},1,2,3,", r.stamp_ns, position(r), wxyz(r));
  })));
  CHECK_THAT(refusal(text_of(
                 "", [](const Row& r) { return "3," + seconds(r) + "," + position(r) + "," + xyzw(r); })),
             Catch::Contains("t.txt:1: 9 fields are neither") && Catch::Contains("name the columns"));
}

TEST_CASE("Matrices may be 4x4, and have a frame's number or a stamp in front", "[trajectory_layout]") {
  const auto numbers = [](const Row& r) { return joined(matrix(r), " "); };
  check_poses(read_as_file(text_of("", numbers)));
  check_poses(read_as_file(text_of("", [&](const Row& r) { return numbers(r) + " 0 0 0 1"; })));
  check_poses(read_as_file(text_of("r11,r12,r13,tx,r21,r22,r23,ty,r31,r32,r33,tz",
                                   [](const Row& r) { return joined(matrix(r), ","); })));
  check_path(read_as_file(text_of("", [&](const Row& r) { return seconds(r) + " " + numbers(r); })));
  check_path(
      read_as_file(text_of("", [&](const Row& r) { return std::to_string(r.stamp_ns) + " " + numbers(r); })));
  const auto by_columns = read_as_file(text_of("", [](const Row& r) {
    Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
    T.topLeftCorner<3, 3>() = r.q.toRotationMatrix();
    T.topRightCorner<3, 1>() = r.p;
    return joined({T.data(), T.data() + 16}, " ");
  }));
  check_poses(by_columns);
  CHECK(by_columns.remarks.size() == 1);
  const auto numbered = read_as_file(text_of("", [&](const Row& r) {
    return std::to_string(2 * (r.stamp_ns - kStart_ns) / kStep_ns + 1) + " " + numbers(r) + " 0 0 0 1";
  }));
  check_poses(numbered);
  CHECK(numbered.stamps_ns.empty());
  CHECK(numbered.frames == std::vector<std::int64_t>{1, 3, 5, 7, 9});
}

TEST_CASE("A quaternion that is nearly of length one is normalised, others are refused",
          "[trajectory_layout]") {
  const auto read = read_as_file("1 0 0 0 0 0 0 1.004\n");
  CHECK((read.poses.at(0).linear() - Eigen::Matrix3d::Identity()).norm() < 1e-15);
  CHECK_THAT(refusal("1 0 0 0 0 0 0 1.2\n"), Catch::Contains("the quaternion has length 1.2, not 1"));
  CHECK_THAT(refusal("1 0 0 0 0 0 0 1\n2 0 0 0 nan 0 0 1\n"),
             Catch::Contains("t.txt:2: 'nan' is not a finite"));
}

TEST_CASE("A given format is not read from a file of another one", "[trajectory_layout]") {
  const std::string kitti = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  CHECK_THAT(refusal(kitti, TrajectoryFormat::kTum), Catch::Contains("12 fields, but TUM has 8"));
  CHECK_THAT(refusal("1 0 0 0 0 0 0 1\n", TrajectoryFormat::kKitti),
             Catch::Contains("8 fields, but KITTI has 12"));
  CHECK_THAT(refusal("1 2 3\n", TrajectoryFormat::kEuroc), Catch::Contains("3 fields, but EuRoC has 8"));
  check_path(
      read_as_file(text_of("", [](const Row& r) { return seconds(r) + "," + position(r) + "," + xyzw(r); }),
                   TrajectoryFormat::kTum));
}

TEST_CASE("Decimal commas are told from commas between fields", "[trajectory_layout]") {
  CHECK(has_decimal_commas("1,5 2,5 3"));
  CHECK(has_decimal_commas("1,5;2,5"));
  CHECK(has_decimal_commas("1,5\t2"));
  CHECK_FALSE(has_decimal_commas("1,2,3"));
  CHECK_FALSE(has_decimal_commas("1, 2, 3"));
  CHECK_FALSE(has_decimal_commas("1 ,2 ,3"));
  CHECK_FALSE(has_decimal_commas("2024-05-01 12:00:00,1,2"));
  CHECK_FALSE(has_decimal_commas(""));
}
