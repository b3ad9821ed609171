// What most tests include, parsed once: it takes longer than what they say themselves.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "device/launcher.hpp"
#include "halfshade/halfshade.hpp"
#include "kernels.hpp"
