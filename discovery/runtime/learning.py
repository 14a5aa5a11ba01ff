"""placeholder"""


class Learner: ...
