#include "mapping/occupancy_map.hpp"
