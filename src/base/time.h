#pragma once

#include "mouthpiece/labels.h"  // Seconds and TimeSpan, which the front door shows
