// Stands in for rclcpp: what the sensor uses of it, without ROS 2.
#pragma once

#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#define RCLCPP_ERROR(logger, ...) \
  (static_cast<void>(logger), std::fprintf(stderr, __VA_ARGS__), std::fputc('\n', stderr))

namespace rclcpp
{
struct Logger {};
struct Time {};
struct Duration {};

template<typename Kind>
struct Service
{
  using SharedPtr = std::shared_ptr<Service>;
  using Callback = std::function<void (
        typename Kind::Request::SharedPtr, typename Kind::Response::SharedPtr)>;
  std::string name;
  Callback callback;
};

struct Node
{
  using SharedPtr = std::shared_ptr<Node>;
  // The last service that was created, whatever its kind.
  std::shared_ptr<void> service;

  template<typename Kind>
  typename Service<Kind>::SharedPtr create_service(
    const std::string & name, typename Service<Kind>::Callback callback)
  {
    auto made = std::make_shared<Service<Kind>>(Service<Kind>{name, callback});
    service = made;
    return made;
  }
};
}  // namespace rclcpp

namespace rclcpp_lifecycle
{
struct State {};
}  // namespace rclcpp_lifecycle
