"""Sentences: everything that stemcal says of its results, in whole templates that can be translated.

    language      the one way in which a template becomes a sentence, in the reader's language
    numbers       how numbers, units and ranges are written
    notes         the sentence of any note (`sentence`), registered by the topics below
    screening, …  one module a topic: what its notes, outcomes and judgements say

Results hold facts only; nothing reads a sentence back.
"""
