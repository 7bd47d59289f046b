"""The question: can this arm cover this surface in one continuous motion?"""
