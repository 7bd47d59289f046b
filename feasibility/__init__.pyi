from .checking import check as check
from .search import Search as Search
from .task import Task as Task
from .verdict import Answer as Answer
from .verdict import Cause as Cause
from .verdict import CauseKind as CauseKind
from .verdict import Evidence as Evidence
from .verdict import Verdict as Verdict
