// Faces that touch the light: that cut a disc, or come as near to a sphere's centre as its surface. What lies before the light
// ends on the light itself there, which no walk from the centre can tell, so that each sample is asked. There are few, or none.

#pragma once

#include "base/lanes.h"

#define HS_TOUCHES 3  // in place of a face's side of the disc
