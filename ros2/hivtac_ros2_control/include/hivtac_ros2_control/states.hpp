// The state interfaces of a sensor, and their values of a sample.
#pragma once

#include <hivtac.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <string>

namespace hivtac_ros2_control
{

// A sample older than this says nothing about now.
constexpr std::int64_t OLDEST_NS = 100'000'000;

// One of them: its name in the robot's description, and its value.
struct State
{
  const char * name;
  double (* value)(const hivtac_sample &);
};

// Those of force_torque_sensor_broadcaster first. Units: N, N·m, N², m; 1 or 0 for yes or no.
inline constexpr std::array<State, 18> STATES{{
  {"force.x", [](const hivtac_sample & s) {return s.force_n[0];}},
  {"force.y", [](const hivtac_sample & s) {return s.force_n[1];}},
  {"force.z", [](const hivtac_sample & s) {return s.force_n[2];}},
  {"torque.x", [](const hivtac_sample & s) {return s.torque_nm[0];}},
  {"torque.y", [](const hivtac_sample & s) {return s.torque_nm[1];}},
  {"torque.z", [](const hivtac_sample & s) {return s.torque_nm[2];}},
  {"force_covariance.xx", [](const hivtac_sample & s) {return s.force_covariance[0];}},
  {"force_covariance.xy", [](const hivtac_sample & s) {return s.force_covariance[1];}},
  {"force_covariance.xz", [](const hivtac_sample & s) {return s.force_covariance[2];}},
  {"force_covariance.yy", [](const hivtac_sample & s) {return s.force_covariance[4];}},
  {"force_covariance.yz", [](const hivtac_sample & s) {return s.force_covariance[5];}},
  {"force_covariance.zz", [](const hivtac_sample & s) {return s.force_covariance[8];}},
  {"place.x", [](const hivtac_sample & s) {return s.place_m[0];}},
  {"place.y", [](const hivtac_sample & s) {return s.place_m[1];}},
  {"place.sigma", [](const hivtac_sample & s) {return s.place_sigma_m;}},
  {"contact", [](const hivtac_sample & s) {return double(s.contact);}},
  {"slip", [](const hivtac_sample & s) {return double(s.slip);}},
  {"status", [](const hivtac_sample & s) {return double(s.status);}},
}};

// The state of a name, or null.
inline const State * find_state(const std::string & name)
{
  for (const State & state : STATES) {
    if (name == state.name) {return &state;}
  }
  return nullptr;
}

// A value of the newest sample; NaN if the sensor sent none lately, and where the sample has none.
inline double value_now(const State & state, const hivtac_sample & sample)
{
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto age = std::chrono::nanoseconds(now).count() - std::int64_t(sample.arrived_ns);
  return age > OLDEST_NS ? std::numeric_limits<double>::quiet_NaN() : state.value(sample);
}

}  // namespace hivtac_ros2_control
