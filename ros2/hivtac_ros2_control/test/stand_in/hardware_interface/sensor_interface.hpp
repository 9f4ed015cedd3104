// Stands in for hardware_interface: the part of its interface that the sensor uses, with the same
// names and signatures. The test sets the description and reads the states.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <vector>

#include "rclcpp/rclcpp.hpp"

namespace hardware_interface
{
enum class CallbackReturn { SUCCESS, FAILURE, ERROR };
enum class return_type { OK, ERROR };

struct InterfaceInfo
{
  std::string name;
};

struct ComponentInfo
{
  std::string name;
  std::vector<InterfaceInfo> state_interfaces;
};

struct HardwareInfo
{
  std::unordered_map<std::string, std::string> hardware_parameters;
  std::vector<ComponentInfo> sensors;
};

struct HardwareComponentInterfaceParams
{
  HardwareInfo hardware_info;
};

class SensorInterface
{
public:
  virtual ~SensorInterface() = default;
  virtual CallbackReturn on_init(const HardwareComponentInterfaceParams & params)
  {
    info_ = params.hardware_info;
    return CallbackReturn::SUCCESS;
  }
  virtual CallbackReturn on_configure(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_cleanup(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_shutdown(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_error(const rclcpp_lifecycle::State &) = 0;
  virtual return_type read(const rclcpp::Time &, const rclcpp::Duration &) = 0;

  template<typename T>
  void set_state(const std::string & name, const T & value) {states[name] = value;}
  rclcpp::Logger get_logger() const {return {};}
  rclcpp::Node::SharedPtr get_node() const {return node;}

  std::map<std::string, double> states;
  rclcpp::Node::SharedPtr node = std::make_shared<rclcpp::Node>();

protected:
  HardwareInfo info_;
};
}  // namespace hardware_interface
