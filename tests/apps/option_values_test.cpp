#include "apps/option_values.hpp"
#include "core/errors.hpp"

#include <catch2/catch.hpp>

#include <limits>

namespace stairwell::apps {

using Words = std::vector<std::string>;

TEST_CASE("numbers are read whole and finite, or refused") {
  CHECK(parse_number("-9") == -9.0);
  CHECK(parse_number(" +2.5e-1 ") == 0.25);
  for (const char* bad : {"", "x", "1x", "1 2", "nan", "inf", "-", "1e999", "0x10"}) {
    CAPTURE(bad);
    CHECK_THROWS_AS(parse_number(bad), InputError);
  }
  for (const char* bad : {"-1", "1.5", "", "99999999999999999999999"}) {
    CAPTURE(bad);
    CHECK_THROWS_AS(parse_count(bad), InputError);
  }
  CHECK(parse_numbers("-9,0,0.5") == std::vector<double>{-9.0, 0.0, 0.5});
  for (const char* bad : {"", ",", "1,,2", "1,2,"}) {
    CAPTURE(bad);
    CHECK_THROWS_AS(parse_numbers(bad), InputError);
  }
}

TEST_CASE("numbers written are read back bit by bit") {
  for (const double value : {0.1, -1.0 / 3.0, 1e-300, 123456789.123456789, 0.0, 45.83662361046586}) {
    CHECK(parse_number(format_number(value)) == value);
  }
}

TEST_CASE("switches and sizes") {
  CHECK(parse_switch("on"));
  CHECK_FALSE(parse_switch("off"));
  CHECK_THROWS_AS(parse_switch("1"), InputError);
  CHECK(parse_size("160x120") == std::pair(160, 120));
  for (const char* bad : {"160", "0x5", "5x0", "x", "-1x5", "5x5x5", "200000x1"}) {
    CAPTURE(bad);
    CHECK_THROWS_AS(parse_size(bad), InputError);
  }
}

TEST_CASE("fields of view in both forms") {
  const FieldOfView camera = parse_fov("90x73.7");
  CHECK(camera.azimuth_deg == 90.0);
  CHECK(camera.elevation_lo_deg == -36.85);
  CHECK(camera.elevation_hi_deg == 36.85);
  const FieldOfView lidar = parse_fov("360x-7..45");
  CHECK(lidar.azimuth_deg == 360.0);
  CHECK(lidar.elevation_lo_deg == -7.0);
  CHECK(lidar.elevation_hi_deg == 45.0);
  const FieldOfView fractions = parse_fov("360x-7.5..45.25");
  CHECK(fractions.elevation_lo_deg == -7.5);
  CHECK(fractions.elevation_hi_deg == 45.25);
  for (const char* bad : {"90", "x", "90x", "90x1..", "90x..2", "90x1..2..3", "wide"}) {
    CAPTURE(bad);
    CHECK_THROWS_AS(parse_fov(bad), InputError);
  }
}

TEST_CASE("values that start with a minus stay with their option") {
  CHECK(join_minus_values({"explore", "w.sdf", "--start", "-9,0,0"}) == Words{"explore", "w.sdf", "--start=-9,0,0"});
  CHECK(join_minus_values({"--box", "-10,-10,0,10,10,4", "--start", "-.5,0,0"}) ==
        Words{"--box=-10,-10,0,10,10,4", "--start=-.5,0,0"});
  CHECK(join_minus_values({"--start=-9,0,0", "--json"}) == Words{"--start=-9,0,0", "--json"});
  CHECK(join_minus_values({"--json", "--quiet", "-o", "x"}) == Words{"--json", "--quiet", "-o", "x"});
  CHECK(join_minus_values({"--", "--start", "-9"}) == Words{"--", "--start", "-9"});
  CHECK(join_minus_values({"--start"}) == Words{"--start"});
}

}  // namespace stairwell::apps
