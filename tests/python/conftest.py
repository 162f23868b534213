"""The helpers beside the tests can be imported."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
