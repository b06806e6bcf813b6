#include "sim3d/ray_caster.hpp"
