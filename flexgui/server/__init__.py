"""The page's server: who may come in, what a browser may say, whose session it is.

browser -> Door (handshake) -> GuardedConnection (each message) -> viser -> the page's callbacks
PageServer: a visit per connection, a session per browser, a page per visit
"""
