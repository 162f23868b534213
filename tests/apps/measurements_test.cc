#include "apps/reconstruct/measurements.h"

#include <gtest/gtest.h>

#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

TEST(Measurements, CellsAreNoFormulas) {
  const MeasuredValue value{"length", "=1+\"2\"", 3.0, 0.1, "world", 0.0};
  EXPECT_CONTAINS(MeasurementsCsv({value}), "length,\"'=1+\"\"2\"\"\",3,0.1,world,");
}

}  // namespace
}  // namespace circline::apps
