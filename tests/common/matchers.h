// The matchers of GoogleMock that most tests use, by their plain names.
#pragma once

#include <gmock/gmock.h>

namespace trueline {

using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAre;

}  // namespace trueline
