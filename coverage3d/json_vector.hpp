#pragma once

#include <nlohmann/json.hpp>

#include <Eigen/Core>

namespace stairwell::coverage3d {

inline nlohmann::json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

inline Eigen::Vector3d vector_of(const nlohmann::json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

}  // namespace stairwell::coverage3d
