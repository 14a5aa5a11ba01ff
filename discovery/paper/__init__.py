"""The paper followed figure by figure and table by table: `active` (compensation in the loop), `chapters`
(what each figure shows here and in the paper), `page` (paper.html).
"""
