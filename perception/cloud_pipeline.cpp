#include "perception/cloud_pipeline.hpp"
