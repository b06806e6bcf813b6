#include "coverage3d/strategy.hpp"
