// Runs the sensor of ros2_control on a simulated one that is pressed: on_twin PORT. Prints states
// as the C example prints samples. Ends with 0 if everything else is right.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include "../src/sensor.hpp"

#define CHECK(what)                                                     \
  do {                                                                  \
    if (!(what)) {                                                      \
      std::fprintf(stderr, "line %d: %s\n", __LINE__, #what);           \
      return 1;                                                         \
    }                                                                   \
  } while (0)

using hardware_interface::CallbackReturn;
using hardware_interface::return_type;
using hivtac_ros2_control::STATES;
using hivtac_ros2_control::Sensor;
using std_srvs::srv::Trigger;

static hardware_interface::HardwareComponentInterfaceParams described(const std::string & port)
{
  hardware_interface::ComponentInfo tip{"tip", {}};
  for (const auto & state : STATES) {
    tip.state_interfaces.push_back({state.name});
  }
  return {{{{"port", port}}, {tip}}};
}

static Trigger::Response tare(Sensor & sensor)
{
  auto response = std::make_shared<Trigger::Response>();
  const auto service =
    std::static_pointer_cast<rclcpp::Service<Trigger>>(sensor.node->service);
  service->callback(std::make_shared<Trigger::Request>(), response);
  return *response;
}

static int reads_forces(Sensor & sensor)
{
  auto & states = sensor.states;
  int known = 0;
  for (int turn = 0; turn < 100; turn++) {
    CHECK(sensor.read({}, {}) == return_type::OK);
    CHECK(states.size() == STATES.size());
    if (!std::isnan(states["tip/force.z"])) {
      known++;
      std::printf(
        "turn %d: %.6f %.6f %.6f N at %.6f %.6f m, contact %g, sigma %.6f N\n", turn,
        states["tip/force.x"], states["tip/force.y"], states["tip/force.z"],
        states["tip/place.x"], states["tip/place.y"], states["tip/contact"],
        std::sqrt(states["tip/force_covariance.zz"]));
      const double x = states["tip/place.x"], z = states["tip/force.z"];
      CHECK(std::abs(states["tip/torque.y"] + x * z) < 1e-9);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  CHECK(known > 10);
  return 0;
}

int main(int count, char ** arguments)
{
  CHECK(count == 2);
  Sensor wrong;
  auto description = described(arguments[1]);
  description.hardware_info.sensors[0].state_interfaces.push_back({"force.w"});
  CHECK(wrong.on_init(description) == CallbackReturn::ERROR);
  description.hardware_info.sensors.clear();
  CHECK(wrong.on_init(description) == CallbackReturn::ERROR);
  CHECK(wrong.on_init(described("tcp:127.0.0.1:1")) == CallbackReturn::SUCCESS);
  CHECK(wrong.on_configure({}) == CallbackReturn::ERROR);

  Sensor sensor;
  CHECK(sensor.on_init(described(arguments[1])) == CallbackReturn::SUCCESS);
  CHECK(sensor.on_configure({}) == CallbackReturn::SUCCESS);
  CHECK(reads_forces(sensor) == 0);
  // The film is pressed, and says so.
  const auto refused = tare(sensor);
  CHECK(!refused.success && refused.message.find("tare") != std::string::npos);
  // A sample that is old, and one without a force, have no number.
  hivtac_sample old{};
  old.arrived_ns = 1;
  CHECK(std::isnan(hivtac_ros2_control::value_now(STATES[0], old)));
  CHECK(sensor.on_cleanup({}) == CallbackReturn::SUCCESS);
  // Nobody has the port any more; what is not open is an error, and no number.
  CHECK(sensor.read({}, {}) == return_type::ERROR);
  CHECK(std::isnan(sensor.states["tip/force.x"]));
  CHECK(sensor.on_error({}) == CallbackReturn::SUCCESS);
  CHECK(sensor.on_configure({}) == CallbackReturn::SUCCESS);
  CHECK(sensor.on_shutdown({}) == CallbackReturn::SUCCESS);
  return 0;
}
