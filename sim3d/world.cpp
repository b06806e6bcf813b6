#include "sim3d/world.hpp"
