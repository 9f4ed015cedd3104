// A sensor of ros2_control: newest force at each read, NaN without one, a service for a
// tare.
#pragma once

#include <hivtac.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "hardware_interface/sensor_interface.hpp"
#include "hivtac_ros2_control/states.hpp"
#include "rclcpp/rclcpp.hpp"
#include "std_srvs/srv/trigger.hpp"

namespace hivtac_ros2_control
{

class Sensor : public hardware_interface::SensorInterface
{
public:
  using CallbackReturn = hardware_interface::CallbackReturn;

  CallbackReturn on_init(
    const hardware_interface::HardwareComponentInterfaceParams & params) override;
  CallbackReturn on_configure(const rclcpp_lifecycle::State & before) override;
  CallbackReturn on_cleanup(const rclcpp_lifecycle::State & before) override;
  CallbackReturn on_shutdown(const rclcpp_lifecycle::State & before) override;
  CallbackReturn on_error(const rclcpp_lifecycle::State & before) override;
  hardware_interface::return_type read(
    const rclcpp::Time & time, const rclcpp::Duration & period) override;

private:
  using Trigger = std_srvs::srv::Trigger;

  std::string parameter(const std::string & name) const;
  void take_tare(Trigger::Response & response);
  void close();

  // The state interfaces that the robot's description has, by their whole names.
  std::vector<std::pair<std::string, const State *>> states_;
  // A tare that is under way keeps its connection; the lock is held to copy or to set it alone.
  std::mutex lock_;
  std::shared_ptr<hivtac> sensor_;
  hivtac_sample newest_{};
  rclcpp::Service<Trigger>::SharedPtr tare_;
};

}  // namespace hivtac_ros2_control
