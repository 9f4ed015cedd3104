#include "sensor.hpp"

#include "pluginlib/class_list_macros.hpp"

namespace hivtac_ros2_control
{
namespace
{

// Longest wait for the sensor's answers while it is configured, s.
constexpr double PATIENCE_S = 2.0;

const char * or_null(const std::string & text) {return text.empty() ? nullptr : text.c_str();}

}  // namespace

std::string Sensor::parameter(const std::string & name) const
{
  const auto found = info_.hardware_parameters.find(name);
  return found == info_.hardware_parameters.end() ? "" : found->second;
}

Sensor::CallbackReturn Sensor::on_init(
  const hardware_interface::HardwareComponentInterfaceParams & params)
{
  if (SensorInterface::on_init(params) != CallbackReturn::SUCCESS) {
    return CallbackReturn::ERROR;
  }
  if (info_.sensors.size() != 1) {
    RCLCPP_ERROR(
      get_logger(), "give one <sensor>, not %zu: a component is one HiVTac", info_.sensors.size());
    return CallbackReturn::ERROR;
  }
  states_.clear();
  for (const auto & interface : info_.sensors[0].state_interfaces) {
    const State * state = find_state(interface.name);
    if (state == nullptr) {
      RCLCPP_ERROR(
        get_logger(), "state interface %s: unknown; docs/robots.md has all",
        interface.name.c_str());
      return CallbackReturn::ERROR;
    }
    states_.emplace_back(info_.sensors[0].name + "/" + interface.name, state);
  }
  return CallbackReturn::SUCCESS;
}

Sensor::CallbackReturn Sensor::on_configure(const rclcpp_lifecycle::State &)
{
  close();
  const std::string port = parameter("port"), device = parameter("device");
  hivtac * opened = hivtac_open(or_null(port), or_null(device), PATIENCE_S);
  if (opened == nullptr) {
    RCLCPP_ERROR(get_logger(), "%s", hivtac_last_error());
    return CallbackReturn::ERROR;
  }
  {
    const std::lock_guard<std::mutex> guard(lock_);
    sensor_.reset(opened, hivtac_close);
  }
  if (const auto node = get_node()) {
    tare_ = node->create_service<Trigger>(
      "~/tare",
      [this](const Trigger::Request::SharedPtr, Trigger::Response::SharedPtr response) {
        take_tare(*response);
      });
  }
  return CallbackReturn::SUCCESS;
}

// Runs in the executor's thread, while `read` goes on in the controller manager's.
void Sensor::take_tare(Trigger::Response & response)
{
  std::shared_ptr<hivtac> sensor;
  {
    const std::lock_guard<std::mutex> guard(lock_);
    sensor = sensor_;
  }
  response.success = sensor && hivtac_tare(sensor.get(), 0) == HIVTAC_DONE;
  response.message = response.success ? "tare taken" : sensor ? hivtac_last_error() : "not open";
}

hardware_interface::return_type Sensor::read(const rclcpp::Time &, const rclcpp::Duration &)
{
  // The lifecycle keeps `close` away from here, so that no lock is needed to look.
  const int result = hivtac_newest(sensor_.get(), 0.0, &newest_);
  if (result < 0) {
    RCLCPP_ERROR(get_logger(), "%s", hivtac_last_error());
    newest_.arrived_ns = 0;
  }
  for (const auto & [name, state] : states_) {
    set_state(name, value_now(*state, newest_));
  }
  return result < 0 ? hardware_interface::return_type::ERROR : hardware_interface::return_type::OK;
}

void Sensor::close()
{
  tare_.reset();
  newest_ = hivtac_sample{};
  const std::lock_guard<std::mutex> guard(lock_);
  sensor_.reset();
}

Sensor::CallbackReturn Sensor::on_cleanup(const rclcpp_lifecycle::State &)
{
  close();
  return CallbackReturn::SUCCESS;
}

Sensor::CallbackReturn Sensor::on_shutdown(const rclcpp_lifecycle::State &)
{
  close();
  return CallbackReturn::SUCCESS;
}

// Unconfigured from here on: it can be configured again when the cable is back.
Sensor::CallbackReturn Sensor::on_error(const rclcpp_lifecycle::State &)
{
  close();
  return CallbackReturn::SUCCESS;
}

}  // namespace hivtac_ros2_control

PLUGINLIB_EXPORT_CLASS(hivtac_ros2_control::Sensor, hardware_interface::SensorInterface)
