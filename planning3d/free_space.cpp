#include "planning3d/free_space.hpp"
